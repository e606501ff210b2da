"""`${…}`: names, literals, comparisons, `and`, `or`, `not`, `in`. A closed language: nothing is ever evaluated as code.

A value that is exactly one `${…}` keeps its type; inside a longer text it becomes text. `$${` is a literal `${`.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias, cast

from busflow.errors import LaunchError, Place, Problem
from busflow.launchfile.yaml.scalar import plain_scalar
from busflow.launchfile.yaml.value import Origin, Scalar, Source, Value
from busflow.text import did_you_mean, printable
from busflow.validation.faults import shown

MAX_LENGTH = 1000
"""Characters of one expression."""
MAX_DEPTH = 32
MAX_SUBSTITUTED = 1 << 20
"""Characters, or items of lists, that all the expressions of one load may put in: no small file becomes a huge one."""

Result: TypeAlias = tuple[Any, Origin | None]
"""A value as plain data, and the origin of the name it was taken from."""
_Thunk: TypeAlias = Callable[[], Result]

_TOKEN = re.compile(
    r"\s*(?:(?P<number>-?[0-9]+(?:\.[0-9]*)?(?:[eE][-+]?[0-9]+)?)|(?P<text>'[^']*'|\"[^\"]*\")"
    r"|(?P<name>[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z0-9_]+)*)|(?P<sign>==|!=|<=|>=|[<>()\[\],}]))"
)
_ENVIRONMENT = re.compile(r"\s*env\.(?P<name>[A-Za-z_][A-Za-z0-9_]*)\s*(?::(?P<kind>[-?])(?P<rest>[^{}]*))?\}")
_COMPARISONS: dict[str, Callable[[Any, Any], bool]] = {
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_WORDS = {"true": True, "false": False, "null": None}


@dataclass(slots=True)
class Budget:
    """How much the expressions of one load may still put in."""

    left: int = MAX_SUBSTITUTED

    def spend(self, data: object) -> bool:
        """Take off what an expression puts in; False when that is too much."""
        self.left -= len(cast("str", data)) if isinstance(data, (str, list)) else 1
        return self.left >= 0


@dataclass(slots=True)
class Scope:
    """What the names in an expression stand for."""

    env: Mapping[str, str]
    args: Mapping[str, Value] = field(default_factory=dict[str, Value])
    broken: frozenset[str] = frozenset()
    """Arguments whose own problem is told already: whatever uses them fails without a word."""
    budget: Budget = field(default_factory=Budget)
    used: set[str] = field(default_factory=set[str])
    """The arguments that some expression names."""
    each: Mapping[str, Value] = field(default_factory=dict[str, Value])
    """The variables of the `for_each` around; below one, keys too may hold expressions."""


class Template:
    """One text with expressions in it."""

    def __init__(self, value: Value, text: str, scope: Scope, *, as_text: bool) -> None:
        self._value = value
        self._text = text
        self._scope = scope
        self._as_text = as_text
        self._at: int = 0
        self._taken: int = 0  # where the last token that was taken begins
        self._depth: int = 0

    def evaluate(self) -> Result:
        """The text, or the value of the only expression that makes it up."""
        parts: list[str] = []
        through: Origin | None = None
        while (dollar := self._text.find("$", self._at)) >= 0:
            parts.append(self._text[self._at : dollar])
            self._at = dollar + 1
            if self._text.startswith("$${", dollar):
                parts.append("${")
                self._at = dollar + 3
            elif not self._text.startswith("{", self._at):
                parts.append("$")
            else:
                self._at += 1
                whole = dollar == 0
                data, origin = self._expression(whole=whole)
                through = through or origin
                if not self._scope.budget.spend(data):
                    raise self._error("the expressions of this file put in too much", "use smaller values", dollar)
                if whole and self._at == len(self._text):
                    return data, through
                parts.append(self._as_part(data, dollar))
        return "".join([*parts, self._text[self._at :]]), through

    def _as_part(self, data: object, start: int) -> str:
        """A value inside a longer text."""
        if isinstance(data, list):
            raise self._error("a list cannot stand inside a text", "let the expression be the whole value", start)
        return data if isinstance(data, str) else shown(data)

    def _expression(self, *, whole: bool) -> Result:
        """What stands between `${` and `}`."""
        start = self._at
        found = _ENVIRONMENT.match(self._text, start)
        if found is not None and len(found.group()) <= MAX_LENGTH:
            self._at = found.end()
            ends_text = self._at == len(self._text)
            return self._environment(found, start, typed=whole and ends_text and not self._as_text)
        thunk = self._or()
        self._expect("}")
        if self._at - start > MAX_LENGTH:
            raise self._error(f"an expression has at most {MAX_LENGTH} characters", "make it shorter", start)
        return thunk()

    def _environment(self, found: re.Match[str], start: int, *, typed: bool) -> Result:
        name, kind, rest = found["name"], found["kind"], found["rest"] or ""
        text, origin = self._scope.env.get(name), Origin(Source.ENVIRONMENT)
        if not text and kind == "-":
            text, origin = rest, None
        elif not text and kind == "?":
            raise self._error(rest.strip() or f"the environment variable {name} is needed", f"set {name}", start)
        if text is None:
            fix = f"set it, or give a default: ${{env.{name}:-…}}"
            raise self._error(f"the environment variable {name} is not set", fix, start)
        if any("\ud800" <= char <= "\udfff" for char in text):
            raise self._error(f"the environment variable {name} is not UTF-8", f"set {name} to a text", start)
        return _typed(text) if typed else text, origin

    def _or(self) -> _Thunk:
        left = self._and()
        while self._take("or"):
            left = self._either(self._taken, left, self._and(), "or", stop=True)
        return left

    def _and(self) -> _Thunk:
        left = self._not()
        while self._take("and"):
            left = self._either(self._taken, left, self._not(), "and", stop=False)
        return left

    def _not(self) -> _Thunk:
        if not self._take("not"):
            return self._comparison()
        at = self._taken
        inner = self._nested(self._not)
        return lambda: (not self._truth(inner(), "not", at), None)

    def _comparison(self) -> _Thunk:
        left = self._primary()
        sign = self._take("==", "!=", "<", "<=", ">", ">=", "in", "not")
        if sign is None:
            return left
        at = self._taken
        if sign == "not":
            self._expect("in")
        right = self._primary()
        if sign in {"==", "!="}:
            return lambda: (_equal(left()[0], right()[0]) is (sign == "=="), None)
        if sign in {"in", "not"}:
            return lambda: (self._within(left()[0], right()[0], at) is (sign == "in"), None)
        return lambda: (self._ordered(sign, left()[0], right()[0], at), None)

    def _primary(self) -> _Thunk:
        start = self._at
        token = _TOKEN.match(self._text, start)
        if token is None:
            raise self._unexpected()
        self._at = token.end()
        if token["text"] is not None:
            text = token["text"][1:-1]
            return lambda: (text, None)
        if token["number"] is not None:
            return self._number(token["number"], start)
        if token["name"] is not None:
            return self._name(token["name"], token.start("name"))
        if token["sign"] == "(":
            inner = self._nested(self._or)
            self._expect(")")
            return inner
        if token["sign"] == "[":
            return self._list()
        self._at = start
        raise self._unexpected()

    def _number(self, text: str, start: int) -> _Thunk:
        try:
            number = plain_scalar(text)
        except ValueError as error:
            raise self._error(str(error), None, start) from None
        return lambda: (number, None)

    def _list(self) -> _Thunk:
        items: list[_Thunk] = []
        while not self._take("]"):
            if items:
                self._expect(",")
            items.append(self._nested(self._or))
        return lambda: ([item()[0] for item in items], None)

    def _name(self, name: str, start: int) -> _Thunk:
        group, _, member = name.partition(".")
        if name in _WORDS:
            return lambda: (_WORDS[name], None)
        if group == "args" and member:
            self._scope.used.add(member)
            if member in self._scope.broken:
                raise LaunchError([])
            value = self._scope.args.get(member)
            if value is None:
                fix = did_you_mean(member, self._scope.args)
                self._scope.used.update(self._scope.args)  # one of them was meant: none is told to be useless
                raise self._error(f"unknown argument {member}", fix, start, len(name))
            return lambda: (value.data, value.origin.through or value.origin)
        if group == "env" and member:
            text = self._scope.env.get(member)
            if self._text.startswith((":-", ":?"), self._at):
                raise self._error("what follows env.… and ':' cannot hold braces", "use an argument", self._at, 2)
            if text is None:
                raise self._error(f"the environment variable {member} is not set", f"set {member}", start, len(name))
            return lambda: (_typed(text), Origin(Source.ENVIRONMENT))
        if group == "each" and member:
            return self._each(member, start)
        fix = f"quote a text: '{name}'; a name is args.… or env.…"
        if name in self._scope.args:
            fix = f"write args.{name}"
        elif name.isupper():
            fix = f"write env.{name}"
        raise self._error(f"unknown name {name}", fix, start, len(name))

    def _each(self, member: str, start: int) -> _Thunk:
        known, path = self._scope.each, tuple(member.split("."))
        if not known:
            fix = "add `for_each: {side: [left, right]}` to the entry"
            raise self._error("`each` is known only below a for_each", fix, start, len(member) + 5)
        value = Value(dict(known), self._value.origin).find(path)
        if value is None:
            found = known.get(path[0])
            members = found.members if found is not None else known
            fix = did_you_mean(path[-1], members) if members else f"each.{path[0]} is {shown(found and found.data)}"
            raise self._error(f"there is no each.{member}", fix, start, len(member) + 5)
        return lambda: (value.data, value.origin.through or value.origin)

    def _either(self, at: int, left: _Thunk, right: _Thunk, word: str, *, stop: bool) -> _Thunk:
        def both() -> Result:
            first = self._truth(left(), word, at)
            return (stop if first is stop else self._truth(right(), word, at)), None

        return both

    def _truth(self, result: Result, word: str, at: int) -> bool:
        if not isinstance(result[0], bool):
            raise self._error(f"'{word}' needs true or false, got {shown(result[0])}", "compare it with something", at)
        return result[0]

    def _ordered(self, sign: str, left: object, right: object, at: int) -> bool:
        kinds = {_kind(left), _kind(right)}
        if kinds not in ({"number"}, {"text"}):
            raise self._error(
                f"'{sign}' cannot compare {shown(left)} with {shown(right)}", "compare like with like", at
            )
        return _COMPARISONS[sign](left, right)

    def _within(self, item: object, container: object, at: int) -> bool:
        if isinstance(container, list):
            return any(_equal(item, each) for each in cast("list[Any]", container))
        if isinstance(container, str) and isinstance(item, str):
            return item in container
        raise self._error(f"'in' cannot look for {shown(item)} in {shown(container)}", "give it a list: [1, 2]", at)

    def _nested(self, parse: Callable[[], _Thunk]) -> _Thunk:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self._error(f"an expression nests at most {MAX_DEPTH} levels", "make it simpler", self._at)
        thunk = parse()
        self._depth -= 1
        return thunk

    def _take(self, *words: str) -> str | None:
        """The next token if it is one of these."""
        token = _TOKEN.match(self._text, self._at)
        found = token and (token["name"] or token["sign"])
        if token is None or found not in words:
            return None
        self._at = token.end()
        self._taken = token.end() - len(found)
        return found

    def _expect(self, word: str) -> None:
        if self._take(word) is None:
            raise self._unexpected(f"'{word}' is missing")

    def _unexpected(self, what: str = "a value is missing") -> LaunchError:
        rest = self._text[self._at :].lstrip()
        start = len(self._text) - len(rest)
        if not rest:
            return self._error(
                "the expression is never closed with '}'", "write ${…}; for a literal ${ write $${", start
            )
        advice = "an expression compares and combines, it does not calculate" if rest[0] in "+-*/%" else None
        return self._error(f"{what} before {printable(rest[0])!r} in the expression", advice, start)

    def _error(self, message: str, fix: str | None, start: int, width: int = 1) -> LaunchError:
        origin = self._value.origin
        place = _within_place(origin.place, self._text, start, width)
        return LaunchError([Problem("expression", message, fix, place, included_from=origin.included_from)])


def _typed(text: str) -> Scalar:
    """A variable of the environment, read as YAML; what is blank or too large for a number is text."""
    if not text.strip():
        return text
    try:
        return plain_scalar(text.strip())
    except ValueError:
        return text


def _equal(left: object, right: object) -> bool:
    """Equality of values of one kind: `true` is not 1."""
    return _kind(left) == _kind(right) and left == right


def _kind(value: object) -> str:
    if isinstance(value, bool) or value is None:
        return "bool" if value is not None else "null"
    if isinstance(value, (int, float)):
        return "number"
    return "text" if isinstance(value, str) else "list"


def _within_place(place: Place | None, text: str, start: int, width: int) -> Place | None:
    """The part of a scalar's place where `text[start]` stands, where the file holds the text as it is."""
    if place is None:
        return None
    found = place.excerpt.find(text, place.column - 1)
    return place if found < 0 else replace(place, column=found + start + 1, width=width)
