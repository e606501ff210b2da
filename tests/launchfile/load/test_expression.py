"""Expressions: closed, typed, limited, with mistakes at their column."""

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import LaunchError
from busflow.launchfile.load.expression import MAX_SUBSTITUTED, Scope
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.yaml.document import parse
from busflow.launchfile.yaml.value import Origin, StatedBy, Value
from busflow.text import printable

ARGS = {"rate": 10, "side": "left", "fast": True, "joints": ["hip", "knee"], "none": None}
ENV = {"LAB": "home", "RATE": "50", "EMPTY": "", "OCTAL": "010", "BYTES": "\udcff", "HUGE": "9" * 30}


def resolve(text: str, *, as_text: bool = False, broken: frozenset[str] = frozenset()) -> tuple[Value, str]:
    """Return a text with its expressions replaced, and the report of its problems."""
    quoted = "'" + text.replace("'", "''") + "'"
    given_args = {name: Value.of(data, Origin(StatedBy.COMMAND_LINE)) for name, data in ARGS.items()}
    problems = Problems()
    resolver = Resolver(Scope(ENV, given_args, broken), problems)
    value = resolver.resolve(parse(f"k: {quoted}".encode(), "f.yaml"), as_text=as_text).members["k"]
    return value, "\n".join(problem.render() for problem in problems.sorted([]))


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("${args.rate}", 10),
        ("${ args.rate }", 10),
        ("${args.fast}", True),
        ("${args.joints}", ["hip", "knee"]),
        ("${args.none}", None),
        ("rate ${args.rate}, ${args.side}, ${args.fast}, ${args.none}", "rate 10, left, true, null"),
        ("${args.rate}${args.rate}", "1010"),
        ("$${args.rate}", "${args.rate}"),
        ("costs $5, $ and $$", "costs $5, $ and $$"),
        ("${env.LAB}", "home"),
        ("${env.RATE}", 50),
        ("at ${env.RATE}", "at 50"),
        ("at ${env.OCTAL}", "at 010"),
        ("${env.HUGE}", "9" * 30),
        ("${env.NOPE:-10}", 10),
        ("${env.EMPTY:-10}", 10),
        ("${env.EMPTY}", ""),
        ("${env.NOPE:-}", ""),
        ("${env.NOPE:-a b}/c", "a b/c"),
        ("${env.LAB:?needed}", "home"),
        ("${env.RATE == 50}", True),
        ("${args.rate == 10 and args.side != 'right'}", True),
        ("${args.rate >= 10.0}", True),
        ("${'a' < 'b'}", True),
        ('${args.side in ["left", "right"]}', True),
        ("${args.side not in ['left']}", False),
        ("${'e' in args.side}", True),
        ("${not args.fast}", False),
        ("${not args.rate == 11}", True),
        ("${args.fast or args.rate}", True),
        ("${false and args.rate}", False),
        ("${(args.rate == 1 or args.rate == 10) and true}", True),
        ("${true == 1}", False),
        ("${1 == 1.0}", True),
        ("${1 < args.rate <= 10}", True),
        ("${1 < args.rate < 10}", False),
        ("${-1.5e3}", -1500.0),
        ("${'}'}", "}"),
        ("${[1, [2, 'x']]}", [1, [2, "x"]]),
    ],
)
def test_expression_is_replaced_by_its_value(text: str, expected: object):
    value, report = resolve(text)
    assert report == ""
    assert value.data == expected
    assert type(value.data) is type(expected)


def test_environment_variable_stays_text_where_wanted():
    assert resolve("${env.RATE}", as_text=True)[0].data == "50"


def test_value_keeps_the_origin_of_its_name():
    value, _ = resolve("${args.rate}")
    assert str(value.origin) == "f.yaml:1:4, from command line"
    assert str(resolve("${env.LAB}")[0].origin) == "f.yaml:1:4, from environment"
    assert str(resolve("${env.NOPE:-1}")[0].origin) == "f.yaml:1:4"


@pytest.mark.parametrize(
    ("text", "column", "message", "fix"),
    [
        ("${args.rat}", 7, "unknown argument rat", "did you mean 'rate'?"),
        ("${rate}", 7, "unknown name rate", "write args.rate"),
        ("${LAB}", 7, "unknown name LAB", "write env.LAB"),
        ("${left}", 7, "unknown name left", "quote a text: 'left'; a name is args.… or env.…"),
        (
            "${each.side}",
            7,
            "`each` is known only below a for_each",
            "add `for_each: {side: [left, right]}` to the entry",
        ),
        ("x ${env.NOPE}", 9, "the environment variable NOPE is not set", "set it, or give a default: ${env.NOPE:-…}"),
        ("${env.NOPE:?say where}", 7, "say where", "set NOPE"),
        ("${env.BYTES}", 7, "the environment variable BYTES is not UTF-8", "set BYTES to a text"),
        ("${env.NOPE:-${args.rate}}", 15, "what follows env.… and ':' cannot hold braces", "use an argument"),
        ("in ${args.joints}", 8, "a list cannot stand inside a text", "let the expression be the whole value"),
        (
            "${args.rate + 1}",
            17,
            "'}' is missing before '+' in the expression",
            "an expression compares and combines, it does not calculate",
        ),
        ("${args.rate", 16, "the expression is never closed with '}'", "write ${…}; for a literal ${ write $${"),
        ("${}", 7, "a value is missing before '}' in the expression", None),
        ("${1 < 2 3}", 13, "'}' is missing before '3' in the expression", None),
        ("${args.rate = 1}", 17, "'=' is not part of the language", "for equality write =="),
        ('${args.rate < "x"}', 17, "'<' cannot compare 10 with text 'x'", "compare like with like"),
        ("${args.rate and true}", 17, "'and' needs true or false, got 10", "compare it with something"),
        ("${1 in 2}", 9, "'in' cannot look for 1 in 2", "give it a list: [1, 2]"),
        ("${1e999}", 7, "the number 1e999 is beyond what a float can hold", None),
        (
            '${__import__("os").system("true")}',
            7,
            "unknown name __import__",
            "quote a text: '__import__'; a name is args.… or env.…",
        ),
        ("${" + "(" * 40 + "1", 40, "an expression nests at most 32 levels", "make it simpler"),
        ("${1 == 1 " + "and 1 == 1 " * 100 + "}", 7, "an expression has at most 1000 characters", "make it shorter"),
    ],
)
def test_wrong_expression_is_reported_at_its_column(text: str, column: int, message: str, fix: str | None):
    _, report = resolve(text)
    first, *_ = report.splitlines()
    assert first == f"f.yaml:1:{column}: error: {message}"
    assert ("\n  fix: " in report) == (fix is not None)
    assert fix is None or f"\n  fix: {fix}" in report


def test_broken_argument_is_not_reported_again():
    value, report = resolve("${args.rate} ${args.other}", broken=frozenset({"rate"}))
    assert report == ""
    assert value.data == "${args.rate} ${args.other}"


def test_small_files_cannot_become_huge_ones(golden):
    args: dict[str, Any] = {"big": Value.of("x" * 5000, Origin(StatedBy.CALLER))}
    problems = Problems()
    resolver = Resolver(Scope({}, args), problems)
    text = "k: [" + ", ".join(['"${args.big}"'] * (MAX_SUBSTITUTED // 5000 + 1)) + "]"
    resolver.resolve(parse(text.encode(), "f.yaml"))
    golden(problems.sorted([])[0].message)


def test_a_hundred_failures_are_enough():
    text = "k: [" + ", ".join(['"${nope}"'] * 1000) + "]"
    problems = Problems()
    with pytest.raises(LaunchError):
        Resolver(Scope({}), problems).resolve(parse(text.encode(), "f.yaml"))
    assert len(problems.sorted([])) == 101


@given(st.text(st.sampled_from("${}args.rateenv()[]'\"<>=!,:-? 10andornot\\\né"), max_size=30))
def test_any_text_is_resolved_or_refused(text: str):
    value, report = resolve(text.replace("\n", " "))
    assert isinstance(value.data, (str, int, float, bool, list, type(None)))
    assert all(line == printable(line) for line in report.split("\n"))


@given(st.text(st.characters(exclude_characters="$", exclude_categories=["Cs", "Cc", "Zl", "Zp"])))
def test_text_without_expression_is_unchanged(text: str):
    value, report = resolve(f"a{text}")
    assert (value.data, report) == (f"a{text}", "")
