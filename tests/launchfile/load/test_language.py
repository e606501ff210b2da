"""Language of `${…}` and `--filter`: its grammar, its agreement with Python, and its limits."""

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from busflow.launchfile.load.language import MAX_DEPTH, MAX_LENGTH, Dialect, InvalidExpression, parse

NAMES = {"a": 3, "b": -0.5, "c": 7, "yes": True, "no": False, "s": "left", "xs": [1, 2.5], "in[0]": 4, "none": []}


def number(text: str) -> float:
    if len(text) > 400:
        raise ValueError("too many digits")
    return float(text) if set(text) & set(".eE") else int(text)


def resolve(name: str, _: int) -> Any:
    return lambda scope: scope[name]


FILTER = Dialect(r"[A-Za-z_]\w*(?:\[[0-9]\])?", resolve, number, repr, calculates=True)
LAUNCH = Dialect(r"[A-Za-z_]\w*(?:\.\w+)*", resolve, number, repr, closing="}")


def value(text: str) -> object:
    return parse(text, FILTER).evaluate(NAMES)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("true", True),
        ("null", None),
        ("None", None),
        ("010", 10),
        (".5", 0.5),
        ("1.", 1.0),
        ("-1e3", -1000.0),
        ("- - a", 3),
        ("a -1", 2),
        ("a-1", 2),
        ("-7 % 4", 1),
        ("a + 2 * c - 1", 16),
        ("(a + c) * 2 - (a - c)", 24),
        (r"'a\n'", r"a\n"),
        ("'ok' == s", False),
        ("''", ""),
        ("yes and 1 <a<= 3\n and not no", True),
        ("a < c < a", False),
        ("not a == c", True),
        ("yes or no and no", True),
        ("yes or s", True),
        ("yes or a < (c) < s", True),
        ("2.5 in xs and 'e' in s", True),
        ("3 not \t in [1, [2], a]", False),
        ("[1, 'x', [],]", [1, "x", []]),
        ("in[0]", 4),
        ("a in[0]", False),
        ("len (xs) + max([a, c]) + abs(b)", 9.5),
        ("1 == yes", False),
        ("a / 0", float("inf")),
        ("9" * 330 + " / 2", float("inf")),
        ("a % 0 == a % 0", False),
    ],
)
def test_expression_evaluates(text: str, expected: object):
    assert value(text) == expected
    assert type(value(text)) is type(expected)


@pytest.mark.parametrize(
    ("text", "start", "message"),
    [
        ("a ** c", 3, "a value is missing before '*' in the expression"),
        ("a // c", 3, "a value is missing before '/' in the expression"),
        ("a is c", 2, "'is' is not expected here"),
        ("a if yes else c", 2, "'if' is not expected here"),
        ("lambda: 1", 6, "':' is not part of the language"),
        ("[a for a in xs]", 3, "']' is missing before 'for' in the expression"),
        ("(a := 1)", 3, "':' is not part of the language"),
        ("(1, 2)", 2, "')' is missing before ',' in the expression"),
        ("1, 2", 1, "',' is not expected here"),
        ("[1 + ]", 5, "a value is missing before ']' in the expression"),
        ("s and yes and no", 2, "'and' needs true or false, got 'left'"),
        ("yes and yes and s", 12, "'and' needs true or false, got 'left'"),
        ("[*xs]", 1, "a value is missing before '*' in the expression"),
        ("f'{a}'", 1, "\"'{a}'\" is not expected here"),
        ("'a' 'b'", 4, "\"'b'\" is not expected here"),
        ("a.__class__", 1, "'.' is not part of the language"),
        ("a[c]", 1, "'[' is not expected here"),
        ("a(1)", 0, "there is no function a"),
        ("max(a, c)", 5, "')' is missing before ',' in the expression"),
        ("len()", 4, "a value is missing before ')' in the expression"),
        ("len(a)(c)", 6, "'(' is not expected here"),
        ("()", 1, "a value is missing before ')' in the expression"),
        ("a == not no", 5, "a value is missing before 'not' in the expression"),
        ("- not no", 2, "a value is missing before 'not' in the expression"),
        ("a not c", 6, "'in' is missing before 'c' in the expression"),
        ("a not", 5, "'in' is missing"),
        ("~a", 0, "'~' is not part of the language"),
        ("0x10", 1, "'x10' is not expected here"),
        ("1_000", 1, "'_000' is not expected here"),
        ("a\0", 1, r"'\\x00' is not part of the language"),
        ("\N{FULLWIDTH LATIN SMALL LETTER A}", 0, "'\N{FULLWIDTH LATIN SMALL LETTER A}' is not part of the language"),
        ("'\N{GRINNING FACE}é' == s s", 10, "'s' is not expected here"),
        ("'\N{GRINNING FACE}é' < (a)", 5, "'<' cannot compare '\N{GRINNING FACE}é' with 3"),
        ("((a)) + ((s))", 6, "'+' calculates with numbers, not with 'left'"),
        ("yes and (no or (a))", 12, "'or' needs true or false, got 3"),
        ("1and'x'", 1, "'and' needs true or false, got 1"),
        ("a < (c) < s", 8, "'<' cannot compare 7 with 'left'"),
        ("abs(s)", 0, "abs() cannot take 'left'"),
        ("-s", 0, "'-' calculates with numbers, not with 'left'"),
        ("9" * 500, 0, "too many digits"),
        ("(" * (MAX_DEPTH + 1), MAX_DEPTH + 1, f"an expression nests at most {MAX_DEPTH} levels"),
        ("not " * (MAX_DEPTH + 1), 131, f"an expression nests at most {MAX_DEPTH} levels"),
        ("not (- (" * 20, 67, f"an expression nests at most {MAX_DEPTH} levels"),
        ("a" * (MAX_LENGTH + 1), 0, f"an expression has at most {MAX_LENGTH} characters"),
    ],
)
def test_wrong_expression_is_refused_at_its_column(text: str, start: int, message: str):
    with pytest.raises(InvalidExpression) as caught:
        value(text)
    assert (caught.value.message, caught.value.start) == (message, start)


def test_launch_file_dialect_has_no_arithmetic():
    found = parse("x ${'}' in [s]} y }", LAUNCH, 4)
    assert (found.evaluate(NAMES), found.end, found.is_operand) == (False, 15, False)
    assert [parse(f"{text}}}", LAUNCH).is_operand for text in ("a", "(a)", "-1", "not yes", "[a]")] == [
        True,
        True,
        True,
        False,
        False,
    ]
    for text, start in [("a + 1}", 2), ("-a}", 0), ("len(a)}", 3), ("a", 1)]:
        with pytest.raises(InvalidExpression) as caught:
            parse(text, LAUNCH)
        assert caught.value.start == start


def test_missing_value_is_a_lookup_error():
    for text in ("nope == 1", "max(none) > 0"):
        with pytest.raises(LookupError):
            value(text)


def test_the_largest_expressions_are_evaluated():
    assert value("+".join(["a"] * (MAX_LENGTH // 2))) == 3 * (MAX_LENGTH // 2)
    assert value(" or ".join(["no"] * (MAX_LENGTH // 6))) is False
    assert value("(" * MAX_DEPTH + "a" + ")" * MAX_DEPTH) == 3
    assert value("no or yes and yes == (" * MAX_DEPTH + "yes" + ")" * MAX_DEPTH) is True
    assert value("[1 + 2 * len(" * (MAX_DEPTH // 2) + "xs" + ")]" * (MAX_DEPTH // 2)) == [3]


PIECES = ["a", "in[0]", "1", "-1", "'x'", "[", "]", "(", ")", ",", "and", "or", "not", "in", "not in", "==", "<=", "<"]
PIECES += ["+", "-", "*", "/", "%", "len(", "max(", "true", "}", ".", "=", "yes", "no"]


@given(st.text(max_size=60) | st.lists(st.sampled_from(PIECES), max_size=30).map(" ".join), st.sampled_from(["", "}"]))
@example("'", "")
@example("\ud800", "")
@example("(" * 200, "")
@example("-" * 999, "")
@example("9" * 5000, "")
@example("\\N{x}" * 100, "")
def test_any_text_is_an_expression_or_refused(text: str, end: str):
    for dialect in (FILTER, LAUNCH):
        mistake = None
        try:
            found = parse(text + end, dialect)
            assert found.end <= len(text + end)
            found.evaluate(NAMES)
        except InvalidExpression as error:
            mistake = error
        except LookupError:
            pass
        assert mistake is None or (mistake.message and 0 <= mistake.start <= len(text + end))


NUMBERS = st.recursive(
    st.sampled_from(["a", "b", "c", "1", "0.25", "len(xs)", "-2"]),
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["+", "-", "*", "/", "%"]), inner).map(" ".join),
        inner.map(lambda text: f"({text})"),
        inner.map(lambda text: f"- {text}"),
        inner.map(lambda text: f"abs({text})"),
    ),
    max_leaves=12,
)
COMPARISONS = st.builds(
    lambda first, others: " ".join([first, *(f"{sign} {each}" for sign, each in others)]),
    NUMBERS,
    st.lists(st.tuples(st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), NUMBERS), min_size=1, max_size=3),
)
CONDITIONS = st.recursive(
    st.sampled_from(["yes", "no", "a in xs", "1 not in [a, b, 1]", "'f' in s"]) | COMPARISONS,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from(["and", "or"]), inner).map(" ".join),
        inner.map(lambda text: f"not {text}"),
        inner.map(lambda text: f"({text})"),
    ),
    max_leaves=8,
)


@given(NUMBERS | CONDITIONS)
@example("1 < a - 1 <= c % 4 and not yes or not a < c < 2")
def test_expressions_agree_with_python(text: str):
    names = {name: each for name, each in NAMES.items() if name.isidentifier()}
    try:
        expected = eval(text, {"abs": abs, "len": len}, names)  # noqa: S307 - the texts are made above, of these pieces
    except ZeroDivisionError:
        return
    with suppress(InvalidExpression):  # too long, or too deep
        assert value(text) == expected


@contextmanager
def counted_calls() -> Iterator[list[int]]:
    calls = [0]

    def count(*_: object) -> None:
        calls[0] += 1

    sys.setprofile(count)
    try:
        yield calls
    finally:
        sys.setprofile(None)


@given(st.sampled_from(PIECES), st.sampled_from(PIECES), st.sampled_from(PIECES))
def test_parsing_time_is_linear(first: str, second: str, third: str):
    for times in (1, 10, 10_000):
        text = f"{first} {second} {third} " * times
        with counted_calls() as calls, suppress(InvalidExpression, LookupError):
            parse(text, FILTER).evaluate(NAMES)
        assert calls[0] < 400 + 60 * min(len(text), MAX_LENGTH)


def test_import_is_light():
    heavy = {"pydantic", "numpy", "yaml", "asyncio"}
    code = f"import sys, busflow.launchfile.load.language; print({heavy!r} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "set()\n"
