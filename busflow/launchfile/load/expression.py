"""Evaluates `${…}` in the texts of a launch file: looks up its names and puts in its value.

A value that is exactly one `${…}` keeps its type; inside a longer text it becomes text. `$${` is a literal `${`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, TypeAlias, cast

from busflow.errors import LaunchError, Place, Problem
from busflow.launchfile.load.language import MAX_LENGTH, Dialect, Evaluate, InvalidExpression, parse
from busflow.launchfile.yaml.scalar import plain_scalar
from busflow.launchfile.yaml.value import Origin, Scalar, StatedBy, Value
from busflow.text import did_you_mean
from busflow.validation.faults import shown

MAX_SUBSTITUTED = 1 << 20
"""Most characters, or items of lists, that all expressions of one load may put in, so that no small file grows huge."""

Result: TypeAlias = tuple[Any, Origin | None]
"""A value as plain data, and the origin of the argument or variable that it was taken from."""

_NAMES = r"[A-Za-z_][A-Za-z0-9_]*(?:\.[A-Za-z0-9_]+)*"
_ENVIRONMENT = re.compile(r"\s*env\.(?P<name>[A-Za-z_][A-Za-z0-9_]*)\s*(?::(?P<kind>[-?])(?P<rest>[^{}]*))?\}")


@dataclass(slots=True)
class Budget:
    """Amount that the expressions of one load may still put in."""

    left: int = MAX_SUBSTITUTED

    def spend(self, data: object) -> bool:
        """Subtract the size of an expression's value; return False if the budget is exceeded."""
        self.left -= len(cast("str", data)) if isinstance(data, (str, list)) else 1
        return self.left >= 0


@dataclass(slots=True)
class Scope:
    """Values of the names in an expression."""

    env: Mapping[str, str]
    args: Mapping[str, Value] = field(default_factory=dict[str, Value])
    broken: frozenset[str] = frozenset()
    """Arguments with a reported problem; an expression that uses one fails without a further report."""
    budget: Budget = field(default_factory=Budget)
    used: set[str] = field(default_factory=set[str])
    """Arguments that some expression names."""
    each: Mapping[str, Value] = field(default_factory=dict[str, Value])
    """Variables of the enclosing `for_each`; inside one, keys too may hold expressions."""


class Template:
    """A text with expressions in it."""

    def __init__(self, value: Value, text: str, scope: Scope, *, as_text: bool) -> None:
        self._value = value
        self._text = text
        self._scope = scope
        self._as_text = as_text
        self._at: int = 0
        self._through: Origin | None = None

    def evaluate(self) -> Result:
        """Return the text with its expressions replaced, or the value of the one expression that is the whole text."""
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
        """Return a value as a part of a longer text."""
        if isinstance(data, list):
            raise self._error("a list cannot stand inside a text", "let the expression be the whole value", start)
        return data if isinstance(data, str) else shown(data)

    def _expression(self, *, whole: bool) -> Result:
        """Evaluate the expression between `${` and `}`."""
        start = self._at
        found = _ENVIRONMENT.match(self._text, start)
        if found is not None and len(found.group()) <= MAX_LENGTH:
            self._at = found.end()
            ends_text = self._at == len(self._text)
            return self._environment(found, start, typed=whole and ends_text and not self._as_text)
        self._through = None
        dialect = Dialect(_NAMES, self._name, cast("Callable[[str], float]", plain_scalar), shown, closing="}")
        try:
            expression = parse(self._text, dialect, start)
            self._at = expression.end
            return expression.evaluate(None), self._through if expression.is_operand else None
        except InvalidExpression as error:
            if error.start >= len(self._text):
                message, fix = "the expression is never closed with '}'", "write ${…}; for a literal ${ write $${"
                raise self._error(message, fix, error.start) from None
            raise self._error(error.message, error.fix, error.start) from None

    def _environment(self, found: re.Match[str], start: int, *, typed: bool) -> Result:
        name, kind, rest = found["name"], found["kind"], found["rest"] or ""
        text, origin = self._scope.env.get(name), Origin(StatedBy.ENVIRONMENT)
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

    def _name(self, name: str, start: int) -> Evaluate:
        """Look up a name."""
        group, _, member = name.partition(".")
        look_up = {"args": self._argument, "env": self._variable, "each": self._each}.get(group)
        if look_up is not None and member:
            data, self._through = look_up(member, start)
            return lambda _: data
        fix = f"quote a text: '{name}'; a name is args.… or env.…"
        if (argument := member or name) in self._scope.args:
            fix = f"write args.{argument}"
            self._scope.used.add(argument)
        elif name.isupper():
            fix = f"write env.{name}"
        raise self._error(f"unknown name {name}", fix, start, len(name))

    def _argument(self, member: str, start: int) -> Result:
        self._scope.used.add(member)
        if member in self._scope.broken:
            raise LaunchError([])
        value = self._scope.args.get(member)
        if value is None:
            known = self._scope.args
            declaration = f"args: {{{member}: {{type: float, default: …}}}}"
            fix = did_you_mean(member, known) if known else f"declare it: {declaration}"
            self._scope.used.update(known)  # one of them was meant: report none as unused
            raise self._error(f"unknown argument {member}", fix, start, len(member) + 5)
        return value.data, value.origin.through or value.origin

    def _variable(self, member: str, start: int) -> Result:
        text, end = self._scope.env.get(member), start + len(member) + 4
        if self._text.startswith((":-", ":?"), end):
            raise self._error("what follows env.… and ':' cannot hold braces", "use an argument", end, 2)
        if text is None:
            raise self._error(f"the environment variable {member} is not set", f"set {member}", start, len(member) + 4)
        return _typed(text), Origin(StatedBy.ENVIRONMENT)

    def _each(self, member: str, start: int) -> Result:
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
        return value.data, value.origin.through or value.origin

    def _error(self, message: str, fix: str | None, start: int, width: int = 1) -> LaunchError:
        origin = self._value.origin
        place = _within_place(origin.place, self._text, start, width)
        return LaunchError([Problem("expression", message, fix, place, included_from=origin.included_from)])


def _typed(text: str) -> Scalar:
    """Read an environment variable as YAML; blank text, or a too large number, stays text."""
    if not text.strip():
        return text
    try:
        return plain_scalar(text.strip())
    except ValueError:
        return text


def _within_place(place: Place | None, text: str, start: int, width: int) -> Place | None:
    """Return the place of `text[start]` within a scalar; the scalar's whole place if the file writes it differently."""
    if place is None:
        return None
    found = place.excerpt.find(text, place.column - 1)
    return place if found < 0 else replace(place, column=found + start + 1, width=width)
