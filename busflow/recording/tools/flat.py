"""Flat columns: the fields of a message side by side, nested ones by their path, and sequences as lists."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from busflow.interfaces.encoding.description import Count, Field, IndividualDescription, fields_of, is_empty, types_in

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel


def listed(value: Any) -> Any:
    """Return the data of a message, or of a part of one.

    >>> listed({"covariance": memoryview(b"ab"), "names": ("left", "right")})
    {'covariance': [97, 98], 'names': ['left', 'right']}
    """
    match value:
        case dict():
            return {name: listed(each) for name, each in cast("dict[str, Any]", value).items()}
        case tuple() | list():
            return [listed(each) for each in cast("tuple[Any, ...]", value)]
        case memoryview():
            return cast("memoryview[Any]", value).tolist()
        case _:
            return value


@dataclass(frozen=True, slots=True)
class FieldColumn:
    """A field of a message, however deep inside it."""

    path: tuple[str, ...]
    field: Field

    @property
    def name(self) -> str:
        """`header.stamp.sec`."""
        return ".".join(self.path)

    def value(self, message: Any) -> Any:
        """Return the field's value in a message that is plain data."""
        for step in self.path:
            message = message[step]
        return message


def columns(channel: Channel) -> tuple[FieldColumn, ...] | None:
    """Return the columns of a channel's messages; None where their type does not decide them, as that of JSON does not.

    Raises:
        BagError: Messages of the channel cannot be read.
    """
    if not channel.type.is_ros:
        return None
    types = types_in(channel.type.description)
    return tuple(_columns(types, channel.type.description["type_description"]["type_name"], ()))


def _columns(types: dict[str, IndividualDescription], name: str, path: tuple[str, ...]) -> Iterator[FieldColumn]:
    if is_empty(types[name]):
        return
    for field in fields_of(types[name]):
        if field.nested and field.count is Count.ONE:
            yield from _columns(types, field.base, (*path, field.name))
        else:
            yield FieldColumn((*path, field.name), field)
