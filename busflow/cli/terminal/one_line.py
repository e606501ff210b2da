"""A message on one line: as comma-separated values, and as `ros2 topic pub` shows what it publishes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, cast

from busflow.cli.terminal.field_paths import Shape
from busflow.text import printable

_NUMBERS = frozenset({int, float, bool})
_QUOTED = frozenset(',"\r\n')


def csv_line(value: Any) -> str:
    """Return all values of an abridged message, separated by commas; text that holds a comma is quoted.

    >>> csv_line({"name": ["a,b", "c"], "stamp": {"sec": 1}, "ok": True})
    '"a,b",c,1,True'
    """
    return ",".join(_cells(value))


def _cells(value: Any) -> Iterator[str]:
    if isinstance(value, Mapping):
        for each in cast("Mapping[str, Any]", value).values():
            yield from _cells(each)
    elif isinstance(value, str):
        shown = printable(value, limit=len(value) + 1)
        yield '"' + shown.replace('"', '""') + '"' if _QUOTED.intersection(value) else shown
    elif isinstance(value, list) and value and _NUMBERS.issuperset(map(type, cast("list[Any]", value)[:-1])):
        yield from map(str, cast("list[Any]", value)[:-1])  # perhaps a million
        yield from _cells(value[-1])
    elif isinstance(value, Sequence):
        for each in cast("Sequence[Any]", value):
            yield from _cells(each)
    else:
        yield str(value)


def python_form(value: Any, shape: Shape | None) -> str:
    """Return an abridged message as Python code that would make it in ROS 2.

    >>> python_form({"data": 1.5}, Shape("std_msgs/msg/Float64", {"data": Shape("float64")}))
    'std_msgs.msg.Float64(data=1.5)'
    """
    if isinstance(value, dict) and shape is not None and shape.fields is not None:
        members = cast("dict[str, Any]", value).items()
        arguments = (f"{key}={python_form(each, shape.fields.get(key))}" for key, each in members)
        return f"{shape.base.replace('/', '.')}({', '.join(arguments)})"
    if isinstance(value, list):
        item = None if shape is None else shape.item
        return "[" + ", ".join(python_form(each, item) for each in cast("list[Any]", value)) + "]"
    return printable(repr(cast("object", value)), limit=1 << 20)
