"""The message types that busflow brings, read from their source: names, fields and comments, without importing any.

Importing them costs pydantic and numpy. Their files are few and regular, and a test compares every type with its class.
"""

from __future__ import annotations

import ast
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

from busflow.interfaces.encoding.description import (
    PRIMITIVES,
    Count,
    Field,
    IndividualDescription,
    TypeDescription,
    assemble,
    individual,
)

_FOLDER = Path(__file__).parents[2] / "msgs"
_PARTS = ("Request", "Response")
_WORDS = {"bool": "bool", "str": "string", "int": "int64", "float": "float64"}


@dataclass(frozen=True, slots=True)
class Comments:
    """What the source says of a type."""

    text: str = ""
    fields: Mapping[str, str] = field(default_factory=dict[str, str])


@dataclass(frozen=True, slots=True)
class _Type:
    """One message as its source declares it; a service's request and response are two."""

    name: str
    body: ast.ClassDef


class ShippedTypes:
    """Every type there is, by its full name."""

    def __init__(self) -> None:
        self._services: dict[str, str] = {}
        self._types: dict[str, _Type] = {}
        for path in sorted(_FOLDER.rglob("*.py")):
            for statement in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(statement, ast.ClassDef):
                    self._add(statement)

    @cached_property
    def messages(self) -> list[str]:
        """The names of the messages, those that are part of a service left out."""
        return sorted(name for name in self._types if "/msg/" in name)

    @property
    def services(self) -> list[str]:
        """The names of the services."""
        return sorted(self._services)

    def description(self, name: str) -> TypeDescription:
        """The description of a message, or of a service's `…_Request` or `…_Response`."""
        types: dict[str, IndividualDescription] = {}
        self._describe(name, types)
        return assemble(name, types)

    def comments(self, name: str) -> Comments:
        """What the source says of a message, or of one half of a service; of the service itself, its docstring."""
        if name in self._services:
            return Comments(self._services[name])
        body = self._types[name].body.body
        told: dict[str, str] = {}
        for statement, after in pairwise(body):
            if isinstance(statement, ast.AnnAssign) and _is_text(after):
                told[ast.unparse(statement.target)] = _text(after)
        return Comments(ast.get_docstring(self._types[name].body) or "", told)

    def _add(self, declared: ast.ClassDef) -> None:
        package = next((ast.literal_eval(each.value) for each in declared.keywords if each.arg == "package"), None)
        if package is None:
            return
        if any(ast.unparse(base) == "Message" for base in declared.bases):
            name = f"{package}/msg/{declared.name}"
            self._types[name] = _Type(name, declared)
            return
        service = f"{package}/srv/{declared.name}"
        self._services[service] = ast.get_docstring(declared) or ""
        for part in declared.body:
            if isinstance(part, ast.ClassDef) and part.name in _PARTS:
                self._types[f"{service}_{part.name}"] = _Type(f"{service}_{part.name}", part)

    def _describe(self, name: str, types: dict[str, IndividualDescription]) -> None:
        """Adds a type and those inside it to `types`."""
        if name in types:
            return
        declared = [each for each in self._types[name].body.body if isinstance(each, ast.AnnAssign)]
        statements = [each for each in declared if not ast.unparse(each.target).startswith("_")]
        fields = [self._field(each, name) for each in statements if not _is_constant(each)]
        types[name] = individual(
            name,
            [each.describe() for each in fields],
            [
                {"name": ast.unparse(each.target), "type": _constant_type(each), "value": _written(_value(each))}
                for each in statements
                if _is_constant(each)
            ],
        )
        for each in fields:
            if each.nested:
                self._describe(each.base, types)

    def _field(self, statement: ast.AnnAssign, around: str) -> Field:
        word, count, size = _shape(ast.unparse(statement.annotation))
        name = ast.unparse(statement.target)
        base = _WORDS.get(word, word)
        if base in PRIMITIVES:
            value = _value(statement)
            return Field(name, base, count=count, size=size, default=_written(value) if value else "")
        return Field(name, self._named(word, around), nested=True, count=count, size=size)

    def _named(self, word: str, around: str) -> str:
        """The full name of a message that another one holds: of its own package, or of the one that has it."""
        own = f"{around.partition('/')[0]}/msg/{word}"
        return own if own in self._types else next(name for name in self.messages if name.endswith(f"/{word}"))


@cache
def shipped_types() -> ShippedTypes:
    """The types, read once."""
    return ShippedTypes()


def _shape(annotation: str) -> tuple[str, Count, int]:
    """What one value of a field is, and how many of them it holds."""
    tree = ast.parse(annotation, mode="eval").body
    if isinstance(tree, ast.Subscript) and ast.unparse(tree.value) == "Annotated":
        inner, length = cast("ast.Tuple", tree.slice).elts
        call = cast("ast.Call", length)
        count = Count.FIXED if call.args else Count.BOUNDED  # Length(9), Length(max=1)
        (size,) = [*call.args, *(each.value for each in call.keywords)]
        return _shape(ast.unparse(inner))[0], count, ast.literal_eval(size)
    if isinstance(tree, ast.Subscript):  # Sequence[…]
        return ast.unparse(tree.slice), Count.UNBOUNDED, 0
    if annotation.endswith("Array") and annotation.removesuffix("Array").lower() in PRIMITIVES:
        return annotation.removesuffix("Array").lower(), Count.UNBOUNDED, 0
    return annotation, Count.ONE, 0


def _is_constant(statement: ast.AnnAssign) -> bool:
    return ast.unparse(statement.annotation).startswith("ClassVar[")


def _constant_type(statement: ast.AnnAssign) -> str:
    word = ast.unparse(cast("ast.Subscript", statement.annotation).slice)
    return _WORDS.get(word, word)


def _value(statement: ast.AnnAssign) -> Any:
    """A default, or a constant, that is written out; None for what has to be constructed: zeros(9), Header()."""
    try:
        return ast.literal_eval(statement.value) if statement.value is not None else None
    except ValueError:
        return None


def _written(value: bool | float | str) -> str:
    return json.dumps(value) if isinstance(value, str | bool) else repr(value)


def _is_text(statement: ast.stmt) -> bool:
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)


def _text(statement: ast.stmt) -> str:
    return str(cast("ast.Constant", cast("ast.Expr", statement).value).value)
