"""Filter: the language of `--filter`, in which a message is told from another. Nothing is ever evaluated as code.

    linear_acceleration.z > 9.5 and not header.frame_id == 'imu_link'
    len(m.name) > 2 and -1.5 < m.position[0] + m.position[1] < 1.5

There are comparisons, which may be chained, `in`, `and or not`, `+ - * / %` and `len abs min max`. A name is a field,
whose path may begin with `m.`, or `m` itself, the whole. What a message lacks, such as an item of a sequence that is
shorter, makes the filter false. Division follows IEEE 754: by zero it is infinite, or not a number.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NoReturn, TypeAlias, cast

from busflow.cli.terminal.field_paths import STEP, Absent, Shape, check_path, value_at
from busflow.errors import InvalidInput, KeyPath, Place, Problem
from busflow.text import did_you_mean, printable

OPTION = "--filter"
MAX_LENGTH = 1000
"""Characters of a filter."""
MAX_DEPTH = 32

Filter: TypeAlias = Callable[[Any], bool]
_Value: TypeAlias = Callable[[Any], Any]

_TOKEN = re.compile(
    r"(?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)|(?P<text>'[^']*'|\"[^\"]*\")"
    r"|(?P<name>[A-Za-z_]\w*(?:\s*\.\s*[A-Za-z_]\w*|\s*\[\s*-?[0-9]{1,9}\s*\])*)"
    r"|(?P<sign>==|!=|<=|>=|[-<>()+*/%,])",
    re.ASCII,
)
_WORDS = {"true": True, "false": False, "null": None, "True": True, "False": False, "None": None}
_KEYWORDS = {"and", "or", "not", "in"}
_ORDERS: dict[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_COMPARISONS = (*_ORDERS, "==", "!=", "in", "not")
_PYTHONS = {"=": "for equality write ==", "&": "write and", "|": "write or", "!": "write not"}


def parse_filter(text: str, shape: Shape | None = None) -> Filter:
    """The filter that a text states.

    >>> wanted = parse_filter("m.data > 0.5 and abs(m.data) < 2")
    >>> wanted({"data": 1.0}), wanted({"data": -1.0})
    (True, False)

    Args:
        text: The filter.
        shape: What it filters, where that is known: a field that is not there is then an error at once.

    Raises:
        InvalidInput: It is none; a caret shows where. The filter itself raises it where a message's values are not
            what an operation needs.
    """
    if len(text) > MAX_LENGTH:
        raise InvalidInput(Problem("filter", f"a filter has at most {MAX_LENGTH} characters", "make it shorter"))
    return _Parser(text, shape).filter()


@dataclass(frozen=True, slots=True)
class _Token:
    kind: str
    text: str
    start: int


class _Parser:
    """Recursive descent: one method a level of precedence; each gives what computes its part of a message."""

    def __init__(self, text: str, shape: Shape | None) -> None:
        self._text, self._shape = text, shape
        self._depth = 0
        self._tokens = self._tokenize()
        self._next = 0

    def filter(self) -> Filter:
        """The whole."""
        value = self._or()
        if self._token.kind != "end":
            self._fail(f"{printable(self._token.text)!r} is not expected here", self._token)
        at = _Token("", self._text, 0)

        def matches(message: Any) -> bool:
            try:
                return self._truth(value(message), at, "a filter")
            except Absent:
                return False

        return matches

    def _or(self) -> _Value:
        return self._joined("or", self._and, stop=True)

    def _and(self) -> _Value:
        return self._joined("and", self._not, stop=False)

    def _joined(self, word: str, part: Callable[[], _Value], *, stop: bool) -> _Value:
        left = part()
        while (at := self._take(word)) is not None:
            left = self._either(left, part(), at, stop=stop)
        return left

    def _either(self, left: _Value, right: _Value, at: _Token, *, stop: bool) -> _Value:
        def either(message: Any) -> bool:
            first = self._truth(left(message), at)
            return stop if first is stop else self._truth(right(message), at)

        return either

    def _not(self) -> _Value:
        at = self._take("not")
        if at is None:
            return self._comparison()
        inner = self._deeper(self._not)
        return lambda message: not self._truth(inner(message), at)

    def _comparison(self) -> _Value:
        left = self._sum()
        links: list[_Value] = []
        while (at := self._take(*_COMPARISONS)) is not None:
            if at.text == "not":
                self._expect("in")
            right = self._sum()
            links.append(self._link(left, right, at))
            left = right
        if not links:
            return left
        return links[0] if len(links) == 1 else lambda message: all(link(message) for link in links)

    def _link(self, left: _Value, right: _Value, at: _Token) -> _Value:
        sign = at.text
        if sign in ("==", "!="):
            return lambda message: _equal(left(message), right(message)) is (sign == "==")
        if sign in ("in", "not"):
            return lambda message: self._within(left(message), right(message), at) is (sign == "in")
        return lambda message: self._ordered(left(message), right(message), at)

    def _sum(self) -> _Value:
        return self._calculated(("+", "-"), lambda: self._calculated(("*", "/", "%"), self._signed))

    def _calculated(self, signs: Sequence[str], part: Callable[[], _Value]) -> _Value:
        left = part()
        while (at := self._take(*signs)) is not None:
            left = self._calculation(left, part(), at)
        return left

    def _calculation(self, left: _Value, right: _Value, at: _Token) -> _Value:
        work = _CALCULATIONS[at.text]

        def calculate(message: Any) -> float:
            operands = self._number(left(message), at), self._number(right(message), at)
            try:
                return work(*operands)
            except OverflowError:  # of integers that no float can hold
                return math.inf

        return calculate

    def _signed(self) -> _Value:
        at = self._take("-", "+")
        if at is None:
            return self._primary()
        inner = self._deeper(self._signed)
        factor = -1 if at.text == "-" else 1
        return lambda message: factor * self._number(inner(message), at)

    def _primary(self) -> _Value:
        token = self._token
        if token.kind == "end":
            self._fail("a value is missing", token)
        self._next += 1
        if token.kind == "number":
            number = float(token.text) if re.search(r"[.eE]", token.text) else int(token.text)
            return lambda _: number
        if token.kind == "text":
            return lambda _: token.text[1:-1]
        if token.kind == "name" and token.text not in _KEYWORDS:
            return self._call(token) if self._take("(") else self._name(token)
        if token.text != "(":
            self._fail(f"a value is missing before {printable(token.text)!r}", token)
        inner = self._deeper(self._or)
        self._expect(")")
        return inner

    def _name(self, token: _Token) -> _Value:
        if token.text in _WORDS:
            return lambda _: _WORDS[token.text]
        steps = [(each["name"] or int(each["index"]), token.start + each.start()) for each in STEP.finditer(token.text)]
        fields = self._shape.fields if self._shape is not None and not self._shape.is_sequence else None
        if steps[0][0] == "m" and "m" not in (fields or ()):
            del steps[0]
        path: KeyPath = tuple(step for step, _ in steps)
        check_path(path, [start for _, start in steps], OPTION, self._text, self._shape)
        return lambda message: value_at(path, message)

    def _call(self, token: _Token) -> _Value:
        if token.text not in _FUNCTIONS:
            self._fail(f"there is no function {token.text}", token, fix=did_you_mean(token.text, _FUNCTIONS))
        argument = self._deeper(self._or)
        self._expect(")")
        function = _FUNCTIONS[token.text]

        def call(message: Any) -> Any:
            value = argument(message)
            try:
                return function(value)
            except TypeError:
                self._fail(f"{token.text}() cannot take {_shown(value)}", token)
            except ValueError:  # the least of nothing
                raise Absent(f"{token.text}() of an empty sequence") from None

        return call

    # What a message's values have to be.

    def _truth(self, value: Any, at: _Token, what: str = "") -> bool:
        if not isinstance(value, bool):
            fix = "compare it with something"
            self._fail(f"{what or repr(at.text)} needs true or false, not {_shown(value)}", at, fix=fix)
        return value

    def _number(self, value: Any, at: _Token) -> float:
        if not _is_number(value):
            self._fail(f"'{at.text}' calculates with numbers, not with {_shown(value)}", at)
        return value

    def _ordered(self, left: Any, right: Any, at: _Token) -> bool:
        if not (_is_number(left) and _is_number(right)) and not (isinstance(left, str) and isinstance(right, str)):
            self._fail(f"'{at.text}' cannot compare {_shown(left)} with {_shown(right)}", at)
        return _ORDERS[at.text](left, right)

    def _within(self, item: Any, container: Any, at: _Token) -> bool:
        if isinstance(container, str) and isinstance(item, str):
            return item in container
        if isinstance(container, str) or not isinstance(container, Sequence | memoryview):
            self._fail(f"'in' cannot look for {_shown(item)} in {_shown(container)}", at)
        return any(_equal(item, each) for each in cast("Sequence[Any]", container))

    # Tokens.

    @property
    def _token(self) -> _Token:
        return self._tokens[self._next]

    def _tokenize(self) -> list[_Token]:
        found: list[_Token] = []
        at = 0
        while rest := self._text[at:].lstrip():
            at = len(self._text) - len(rest)
            token = _TOKEN.match(self._text, at)
            if token is None:
                unclosed = "a quote is never closed" if rest[0] in "'\"" else None
                what = unclosed or f"{printable(rest[0])!r} is not part of the language"
                self._fail(what, _Token("", rest[0], at), fix=_PYTHONS.get(rest[0]))
            found.append(_Token(token.lastgroup or "", token.group(), at))
            at = token.end()
        return [*found, _Token("end", "", len(self._text))]

    def _take(self, *words: str) -> _Token | None:
        """The next token if it is one of these."""
        token = self._token
        if token.kind not in ("name", "sign") or token.text not in words:
            return None
        self._next += 1
        return token

    def _expect(self, word: str) -> None:
        if self._take(word) is None:
            self._fail(f"'{word}' is missing", self._token)

    def _deeper(self, parse: Callable[[], _Value]) -> _Value:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            self._fail(f"a filter nests at most {MAX_DEPTH} levels", self._token)
        found = parse()
        self._depth -= 1
        return found

    def _fail(self, message: str, at: _Token, *, fix: str | None = None) -> NoReturn:
        place = Place(OPTION, 1, at.start + 1, max(1, len(at.text)), self._text)
        raise InvalidInput(Problem("filter", message, fix, place))


def _divided(left: float, right: float) -> float:
    if right:
        return left / right
    return math.nan if not left or math.isnan(left) else math.copysign(math.inf, left)


_CALCULATIONS: dict[str, Callable[[Any, Any], Any]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": _divided,
    "%": lambda left, right: left % right if right else math.nan,
}
_FUNCTIONS: dict[str, Callable[[Any], Any]] = {"len": len, "abs": abs, "min": min, "max": max}


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _equal(left: Any, right: Any) -> bool:
    """Equality of values of one kind: `true` is not 1."""
    return isinstance(left, bool) is isinstance(right, bool) and left == right


def _shown(value: Any) -> str:
    if isinstance(value, memoryview):
        return "a sequence"
    return printable(repr(value), limit=60)
