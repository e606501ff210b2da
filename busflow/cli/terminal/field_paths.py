"""Field paths: `linear_acceleration.z` or `points[0].x`, checked against the fields of a type."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, cast

from busflow.errors import InvalidInput, KeyPath, Place, Problem
from busflow.interfaces.encoding.description import Count, IndividualDescription, fields_of, is_empty, types_in
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType


@dataclass(frozen=True, slots=True)
class Shape:
    """The kind of a value: text, a number, a message with its fields, or a sequence of one of these."""

    base: str
    """`float64`, `string`, or the name of a message type."""
    fields: Mapping[str, Shape] | None = None
    """The fields of a message; None for a plain value."""
    count: Count = Count.ONE
    size: int = 0
    """The length of a fixed array, or the most items of a bounded sequence."""

    @property
    def is_sequence(self) -> bool:
        """Whether it holds several values."""
        return self.count is not Count.ONE

    @property
    def item(self) -> Shape:
        """The shape of a sequence's items."""
        return replace(self, count=Count.ONE, size=0)


def shape_of(type_: ForeignType) -> Shape | None:
    """Return the shape of a type's messages; None for a JSON Schema, whose values may have several shapes."""
    return _Shapes(types_in(type_.description)).of(type_.name) if type_.is_ros else None


@dataclass(frozen=True, slots=True)
class _Shapes:
    types: Mapping[str, IndividualDescription]
    made: dict[str, Shape] = field(default_factory=dict[str, Shape])

    def of(self, name: str) -> Shape:
        """Return the shape of a message type."""
        if name not in self.made:
            described = self.types[name]
            members = () if is_empty(described) else fields_of(described)
            fields = {
                each.name: replace(
                    self.of(each.base) if each.nested else Shape(each.base), count=each.count, size=each.size
                )
                for each in members
            }
            self.made[name] = Shape(name, fields)
        return self.made[name]


STEP = re.compile(r"(?P<name>[A-Za-z_]\w*)|\[\s*(?P<index>-?[0-9]{1,9})\s*\]", re.ASCII)


class Absent(LookupError):
    """The error for a message without a value at a path: a sequence is too short, or its JSON leaves the field out."""


def parse_path(text: str, option: str, shape: Shape | None = None) -> KeyPath:
    """Parse a path.

    >>> parse_path("points[0].x", "--field")
    ('points', 0, 'x')

    Args:
        text: The path.
        option: The option that has the path as value, for the error.
        shape: The shape of the messages, if it is known.

    Raises:
        InvalidInput: It is not a path, or there is no such field; a caret shows where.
    """
    steps: list[tuple[str | int, int]] = []
    at = 0
    while at < len(text):
        if steps and text[at] == ".":
            at += 1
        found = STEP.match(text, at)
        # A name follows a dot, or begins; an index follows a name, or another index.
        if found is None or (found["name"] is None) is not (bool(steps) and text[at - 1] != "."):
            raise _invalid("a path is field.field or field[0].field", option, text, at)
        steps.append((found["name"] or int(found["index"]), at))
        at = found.end()
    if not steps:
        raise _invalid("a field is missing", option, text, at)
    path = tuple(step for step, _ in steps)
    check_path(path, [start for _, start in steps], option, text, shape)
    return path


def check_path(path: KeyPath, starts: Sequence[int], option: str, text: str, shape: Shape | None) -> Shape | None:
    """Return the shape of the value at a path, whose steps begin at `starts` in `text`; None if it is not known.

    Raises:
        InvalidInput: There is no such field.
    """
    for step, start in zip(path, starts, strict=True):
        if shape is None:
            return None
        if isinstance(step, int):
            if not shape.is_sequence:
                raise _invalid(f"{_named(shape)} is not a sequence", option, text, start, len(f"[{step}]"))
            if shape.size and not -shape.size <= step < shape.size:  # a size of 0 is no limit
                why = f"there is no item {step}, there are {'at most ' * (shape.count is Count.BOUNDED)}{shape.size}"
                raise _invalid(why, option, text, start, len(f"[{step}]"), fix=f"the last one is [{shape.size - 1}]")
            shape = shape.item
        elif shape.is_sequence:
            raise _invalid("a sequence is followed by an index, such as [0]", option, text, start, len(step))
        elif shape.fields is None:
            raise _invalid(f"{_named(shape)} has no fields", option, text, start, len(step))
        elif step not in shape.fields:
            fix = did_you_mean(step, shape.fields, none="leave the name out: there are no fields")
            raise _invalid(f"{_named(shape)} has no field {step}", option, text, start, len(step), fix=fix)
        else:
            shape = shape.fields[step]
    return shape


def shape_at(path: KeyPath, shape: Shape | None) -> Shape | None:
    """Return the shape of the value at a checked path."""
    for step in path:
        if shape is not None:
            shape = shape.item if isinstance(step, int) else (shape.fields or {}).get(step)
    return shape


def value_at(path: KeyPath, value: Any) -> Any:
    """Return the value at a path of a message; the path has been checked against the message's shape.

    >>> value_at(("points", -1), {"points": (1, 2)})
    2

    Raises:
        Absent: This message has no value there.
    """
    for step in path:
        if isinstance(step, int) and isinstance(value, Sequence | memoryview) and not isinstance(value, str):
            items = cast("Sequence[Any]", value)
            if not -len(items) <= step < len(items):
                raise Absent(f"there is no item {step}, there are {len(items)}")
            value = items[step]
        elif isinstance(step, str) and isinstance(value, Mapping) and step in value:
            value = cast("Mapping[str, Any]", value)[step]
        else:
            raise Absent(f"there is no {printable(step)!r}")
    return value


def _named(shape: Shape) -> str:
    return f"a {shape.base}" if shape.fields is None else shape.base


def _invalid(
    message: str, option: str, text: str, start: int, width: int = 1, *, fix: str | None = None
) -> InvalidInput:
    return InvalidInput(Problem("path", message, fix, Place(option, 1, start + 1, width, text)))
