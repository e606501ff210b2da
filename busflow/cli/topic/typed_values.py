"""Typed values: YAML from the command line of `topic pub` and `service call`, checked against a message type."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from busflow.cli.terminal.field_paths import Shape, shape_at
from busflow.clock import NS_PER_S
from busflow.errors import InvalidInput, MalformedMessage, Problem
from busflow.launchfile.yaml.document import parse
from busflow.launchfile.yaml.value import Value

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType

_LABEL = "VALUES"
_HEADER = "std_msgs/msg/Header"
_TIME = "builtin_interfaces/msg/Time"


class TypedValues:
    """The values of a message, ready to be encoded."""

    def __init__(self, text: str, type_: ForeignType, shape: Shape | None) -> None:
        """Read values, and check that they make a message.

        Raises:
            LaunchError: They are not YAML.
            InvalidInput: They do not fit the type; a caret shows which value.
        """
        self._value = parse(text.encode(errors="surrogateescape") if text.strip() else b"{}", _LABEL)
        self._shape = shape
        if not isinstance(self._value.content, dict):
            place = self._value.origin.place
            fix = _by_name(text.strip(), tuple(shape.fields)) if shape and shape.fields else None
            raise InvalidInput(Problem("values", f"{type_.name} takes its fields by name", fix, place))
        try:
            type_.encode(self.at(0))
        except MalformedMessage as error:
            raise InvalidInput(self._problem(error)) from None

    def at(self, now_ns: int) -> Mapping[str, Any]:
        """Return the values of a message made at this time, with `auto` and `now` filled in."""
        seconds, nanoseconds = divmod(now_ns, NS_PER_S)
        stamp = {"sec": seconds, "nanosec": nanoseconds}
        return _stamped(cast("dict[str, Any]", self._value.data), self._shape, stamp)

    def _problem(self, error: MalformedMessage) -> Problem:
        """Return the problem with its place in the text."""
        value, shape, place = self._value, self._shape, self._value.origin.place
        for step in error.path:
            found = _member(value, step)
            if found is None:
                break
            value, shape, place = found, shape_at((step,), shape), found.origin.place
        for key, member in value.members.items():
            if shape is not None and shape.fields is not None and key not in shape.fields:
                return Problem("values", error.reason, None, member.key)
        where = "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in error.path).lstrip(".")
        unquoted = isinstance(value.content, int | float) and error.reason.endswith("is not a text")
        return Problem("values", f"{error.type_name}: {where}: {error.reason}", "quote it" if unquoted else None, place)


def _by_name(text: str, fields: Sequence[str]) -> str:
    """Return the fix for values that are no mapping."""
    field, colon, value = text.partition(":")
    if colon and field in fields:
        return f"write {field}: {value}, with a space after the colon"
    return f"write {fields[0]}: {text}"


def _member(value: Value, step: str | int) -> Value | None:
    content = value.content
    if isinstance(step, int):
        return content[step] if isinstance(content, list) and step < len(content) else None
    return content.get(step) if isinstance(content, dict) else None


def _stamped(data: Any, shape: Shape | None, stamp: Mapping[str, int]) -> Any:
    """Return the data with `auto` for a header and `now` for a time replaced."""
    if shape is None:
        return data
    if not shape.is_sequence and (shape.base, data) == (_HEADER, "auto"):
        return {"stamp": stamp}
    if not shape.is_sequence and (shape.base, data) == (_TIME, "now"):
        return stamp
    if isinstance(data, list) and shape.is_sequence:
        return [_stamped(each, shape.item, stamp) for each in cast("list[Any]", data)]
    if isinstance(data, dict) and shape.fields is not None:
        members = cast("dict[str, Any]", data).items()
        return {key: _stamped(each, shape.fields.get(key), stamp) for key, each in members}
    return cast("object", data)
