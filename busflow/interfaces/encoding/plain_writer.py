"""Writes messages from plain values, such as those of a command line, by their type's description alone.

A field that is not given has its default; a field that there is not, or a value that does not fit, is an error that
names it. Neither pydantic nor numpy is needed.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from struct import Struct, pack
from struct import error as StructError  # noqa: N812 - it is an exception, whatever the standard library calls it
from typing import Any, TypeAlias, cast

from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.cdr_layout import HEADER, padding
from busflow.interfaces.encoding.description import (
    PRIMITIVES,
    Count,
    Field,
    IndividualDescription,
    TypeDescription,
    brief,
    check,
    fields_of,
    is_empty,
    types_in,
)
from busflow.interfaces.encoding.stated_values import value_of
from busflow.text import did_you_mean

Writer: TypeAlias = Callable[[bytearray, Any], None]


class _Unfit(Exception):
    """The error for a value that does not fit its field; `path` grows from the inside out."""

    def __init__(self, reason: str) -> None:
        self.reason, self.path = reason, list[str | int]()


def encoder_from_description(description: TypeDescription) -> Callable[[Mapping[str, Any]], bytes]:
    """Return a function that writes messages of the described type, given as nested mappings and sequences.

    It raises MalformedMessage where a value does not fit.

    Raises:
        MalformedMessage: the description is malformed, or one of its defaults does not fit.
    """
    name = description["type_description"]["type_name"]
    write = _Writers(types_in(check(description))).of(name)

    def encode(values: Mapping[str, Any]) -> bytes:
        data = bytearray(HEADER)
        try:
            write(data, values)
        except _Unfit as fault:
            raise MalformedMessage(fault.reason, type_name=name, path=tuple(reversed(fault.path))) from None
        return bytes(data)

    return encode


class _Writers:
    """The writer of each type, and its default value."""

    def __init__(self, types: dict[str, IndividualDescription]) -> None:
        self._types = types
        self._writers: dict[str, Writer] = {}

    def of(self, name: str) -> Writer:
        """Return the writer of messages of this type."""
        if name not in self._writers:
            described = self._types[name]
            fields = fields_of(described)
            writers = {field.name: (self._field(field), _default(field, name)) for field in fields}
            self._writers[name] = _message(name, writers, empty=is_empty(described))
        return self._writers[name]

    def _field(self, field: Field) -> Writer:
        if field.count is Count.ONE:
            return self._item(field)
        primitive = None if field.nested else PRIMITIVES[field.base]
        if primitive and primitive.size:
            return _sized(field, _numbers(field.base, primitive.code, primitive.size))
        return _sized(field, _items(self._item(field)))

    def _item(self, field: Field) -> Writer:
        if field.nested:
            return self.of(field.base)
        primitive = PRIMITIVES[field.base]
        if primitive.size:
            return _number(field.base, primitive.code, primitive.size)
        return _text(field.string_bound, wide=field.base == "wstring")


def _message(name: str, fields: dict[str, tuple[Writer, Any]], *, empty: bool) -> Writer:
    known = () if empty else fields

    def write(data: bytearray, value: Any) -> None:
        if not isinstance(value, Mapping):
            raise _Unfit(f"{name} takes its fields by name, not {brief(value)}")
        given = cast("Mapping[str, Any]", value)
        for key in given:
            if key not in known:
                raise _Unfit(f"{name} has no field {str(key)!r:.60}; {did_you_mean(str(key), known)}")
        for key, (writer, default) in fields.items():
            try:
                writer(data, given.get(key, default))
            except _Unfit as fault:
                fault.path.append(key)
                raise

    return write


def _sized(field: Field, inner: Writer) -> Writer:
    """Write the number of items, unless it is fixed, and then the items."""

    def write(data: bytearray, value: Any) -> None:
        if isinstance(value, str | Mapping) or not hasattr(value, "__len__"):
            raise _Unfit(f"a list is needed, not {brief(cast('object', value))}")
        count = len(value)
        if field.count is Count.FIXED and count != field.size:
            raise _Unfit(f"exactly {field.size} items are needed, not {count}")
        if field.count is Count.BOUNDED and count > field.size:
            raise _Unfit(f"at most {field.size} items are allowed, not {count}")
        if field.count is not Count.FIXED:
            _put(data, 4, pack("<I", count))
        inner(data, value)

    return write


def _items(writer: Writer) -> Writer:
    def write(data: bytearray, value: Any) -> None:
        for index, item in enumerate(value):
            try:
                writer(data, item)
            except _Unfit as fault:
                fault.path.append(index)
                raise

    return write


def _numbers(base: str, code: str, size: int) -> Writer:
    def write(data: bytearray, value: Any) -> None:
        numbers = list(value)
        for index, number in enumerate(numbers):
            try:
                _check(base, code, number)
            except _Unfit as fault:
                fault.path.append(index)
                raise
        if numbers:
            _put(data, size, pack(f"<{len(numbers)}{code}", *numbers))

    return write


def _number(base: str, code: str, size: int) -> Writer:
    packed = Struct(f"<{code}").pack

    def write(data: bytearray, value: Any) -> None:
        _check(base, code, value)
        _put(data, size, packed(value))

    return write


def _check(base: str, code: str, value: Any) -> None:
    """Refuse a value that is not a number of this type; `pack` would let some pass."""
    accepted = bool if code == "?" else (float, int) if code in "fd" else int
    if not isinstance(value, accepted) or (isinstance(value, bool) and code != "?"):
        raise _Unfit(f"{brief(value)} is not a valid {base}")
    try:
        pack(f"<{code}", value)
    except (StructError, OverflowError):
        raise _Unfit(f"{brief(value)} is out of the range of {base}") from None
    if code in "fd" and isinstance(value, int) and float(value) != value:
        raise _Unfit(f"no {base} is {brief(value)}; write the nearest, {float(value)}")


def _text(bound: int, *, wide: bool) -> Writer:
    def write(data: bytearray, value: Any) -> None:
        if not isinstance(value, str):
            raise _Unfit(f"{brief(value)} is not a text")
        try:
            units = value.encode("utf-16-le") if wide else value.encode()
        except UnicodeEncodeError as error:
            raise _Unfit(f"{brief(value)} is not valid Unicode: {error.reason}") from None
        size = len(units) // 2 if wide else len(units)
        if bound and len(value) > bound:
            raise _Unfit(f"{len(value)} characters where {bound} are allowed")
        body = b"".join(units[i : i + 2] + b"\0\0" for i in range(0, len(units), 2)) if wide else units + b"\0"
        _put(data, 4, pack("<I", size if wide else len(body)))
        data += body

    return write


def _put(data: bytearray, size: int, value: bytes) -> None:
    data += bytes(padding(len(data), size)) + value


def _default(field: Field, around: str) -> Any:
    """Return the value of a field that is not given."""
    zero: Any = {} if field.nested else "" if not PRIMITIVES[field.base].size else _zero(field.base)
    if field.default and not field.nested:
        try:
            return value_of(field)
        except ValueError:
            raise MalformedMessage(
                f"{brief(field.default)} is not a default of {field.base}", type_name=around, path=(field.name,)
            ) from None
    if field.count is Count.ONE:
        return zero
    return _Repeated(zero, field.size) if field.count is Count.FIXED else ()


def _zero(base: str) -> bool | float:
    return False if base == "bool" else 0


class _Repeated(Sequence[Any]):
    """One value repeated, without memory for each: a peer stated the length."""

    def __init__(self, value: Any, length: int) -> None:
        self._value, self._length = value, length

    def __len__(self) -> int:
        return self._length

    def __getitem__(self, index: Any) -> Any:
        if not 0 <= index < self._length:
            raise IndexError(index)
        return self._value
