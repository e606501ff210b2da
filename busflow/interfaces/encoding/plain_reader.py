"""Reads messages by their type's description alone, as plain values: dictionaries, tuples, text and numbers.

This needs no class, no pydantic and no numpy: the command line reads with it. It also says what is wrong with a
message that cannot be read, down to the field and the byte. A message is read like this, here and in `cdr_decoder.py`:

- The header must be that of plain CDR, big or little endian; its two option bytes are ignored.
- A length is compared with the bytes that are left before memory is taken for so many items.
- Text is UTF-8 that ends with a NUL; a length of 0, which some programs write, is empty text. A bool is 0 or 1.
- Up to 3 bytes of any value may follow the message, because transports pad it to a multiple of 4. More are an error:
  the message is then probably of another type.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Callable
from struct import Struct
from typing import Any, TypeAlias, TypeVar, cast

from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.cdr_layout import BIG_ENDIAN, HEADER, HEADER_SIZE, SPARE, padding
from busflow.interfaces.encoding.description import (
    PRIMITIVES,
    Count,
    Field,
    IndividualDescription,
    TypeDescription,
    check,
    fields_of,
    is_empty,
    types_in,
)

_TEXT = "string"
_array: Any = array  # the type hints of `array` accept only a literal type code
_WIDE = 4
"""Bytes of a unit of wide text. ROS 2 writes each UTF-16 unit in 32 bits, after the number of units, without a NUL."""


class _Unreadable(Exception):
    """The error for bytes that do not fit a field; `path` has the innermost field first."""

    def __init__(self, reason: str, offset: int) -> None:
        self.reason, self.offset, self.path = reason, offset, list[str | int]()


class _Cursor:
    """The offset up to which the message is read."""

    __slots__ = ("data", "little", "offset")

    def __init__(self, data: bytes, *, little: bool) -> None:
        self.data, self.little, self.offset = data, little, HEADER_SIZE

    def claim(self, count: int, size: int) -> int:
        """Move the cursor over `count` values of `size` bytes, and return the offset at which they begin.

        Padding comes before the first value; without values there is none.
        """
        start = self.offset
        if count:
            start += padding(start, size)
        end = start + count * size
        if end > len(self.data):
            left = max(len(self.data) - start, 0)
            raise _Unreadable(f"{count * size} bytes are needed and {left} are left", start)
        self.offset = end
        return start

    def length(self, least: int, most: int, what: str = "items") -> int:
        """Read and return the number of items, or raise if the message cannot hold so many.

        Args:
            least: the fewest bytes that an item takes.
            most: the largest allowed number; 0 is no limit.
            what: the word for the items, for the error.
        """
        start = self.claim(1, 4)
        count = int.from_bytes(self.data[start : start + 4], "little" if self.little else "big")
        left = len(self.data) - self.offset
        if most and count > most:
            raise _Unreadable(f"{count} {what} are announced where {most} are allowed", start)
        if count * least > left:
            needed = f" that take {count * least} bytes at least" if least > 1 else ""
            raise _Unreadable(f"{count} {what}{needed} are announced and {left} bytes are left", start)
        return count


Reader: TypeAlias = Callable[[_Cursor], Any]
Payload: TypeAlias = bytes | bytearray | memoryview
Result = TypeVar("Result")


def decoder_from_description(description: TypeDescription) -> Callable[[Payload], dict[str, Any]]:
    """Return a function that reads messages of the described type.

    Fields become a dictionary in their order. A sequence of numbers becomes a memoryview, of the message's bytes if
    their order is this machine's, else of a copy; any other sequence becomes a tuple. The function raises
    MalformedMessage if a message cannot be read.

    Raises:
        MalformedMessage: the description is malformed.
    """
    return _reading(description, _whole)


def measure_from_description(description: TypeDescription) -> Callable[[Payload], int]:
    """Return a function that returns the size of the message at the start of bytes.

    The function raises MalformedMessage if the bytes begin with no message of this type.

    Raises:
        MalformedMessage: the description is malformed.
    """
    return _reading(description, lambda data, read: _begun(data, read)[1].offset)


def _reading(description: TypeDescription, take: Callable[[bytes, Reader], Result]) -> Callable[[Payload], Result]:
    """Return a function that applies `take` to bytes and the reader of the described type.

    It raises MalformedMessage for bytes that are no such message.
    """
    types = types_in(check(description))
    name = description["type_description"]["type_name"]
    read = _Readers(types).of(name)

    def reading(payload: Payload) -> Result:
        try:
            return take(bytes(payload), read)
        except _Unreadable as fault:
            where = tuple(reversed(fault.path))
            raise MalformedMessage(fault.reason, type_name=name, path=where, offset=fault.offset) from None

    return reading


def _whole(data: bytes, read: Reader) -> Any:
    """Return the message that `data` is, with up to `SPARE` bytes after it."""
    value, cursor = _begun(data, read)
    if (left := len(data) - cursor.offset) > SPARE:
        raise _Unreadable(f"{left} bytes follow the message", cursor.offset)
    return value


def _begun(data: bytes, read: Reader) -> tuple[Any, _Cursor]:
    """Return the message at the start of `data`, and the cursor at its end."""
    little = data[:2] == HEADER[:2]
    if len(data) < HEADER_SIZE or not (little or data[:2] == BIG_ENDIAN):
        raise _Unreadable(f"{data[:4].hex(' ') or 'nothing'} is not a header of plain CDR", 0)
    cursor = _Cursor(data, little=little)
    return read(cursor), cursor


class _Readers:
    """Readers of types, each made once, and the fewest bytes that a value of a type takes."""

    def __init__(self, types: dict[str, IndividualDescription]) -> None:
        self._types = types
        self._readers: dict[str, Reader] = {}
        self._least: dict[str, int] = {}

    def of(self, name: str) -> Reader:
        """Return the reader of messages of this type."""
        if name not in self._readers:
            fields = fields_of(self._types[name])
            readers = [(field.name, self._field(field)) for field in fields]
            self._readers[name] = _message(readers, empty=is_empty(self._types[name]))
        return self._readers[name]

    def least(self, field: Field) -> int:
        """Return the fewest bytes that one item of the field takes, padding left out."""
        if not field.nested:
            return PRIMITIVES[field.base].size or 4  # text has no fixed size: its length takes 4 bytes
        if field.base not in self._least:
            self._least[field.base] = sum(self._least_of_all(each) for each in fields_of(self._types[field.base]))
        return self._least[field.base]

    def _least_of_all(self, field: Field) -> int:
        if field.count in (Count.ONE, Count.FIXED):
            return self.least(field) * (field.size or 1)
        return 4

    def _field(self, field: Field) -> Reader:
        primitive = None if field.nested else PRIMITIVES[field.base]
        if field.count is Count.ONE:
            return self._item(field)
        exactly = field.size if field.count is Count.FIXED else None
        if primitive and primitive.size:
            return _numbers(primitive.code, primitive.size, exactly, field.size)
        return _items(self._item(field), self.least(field), exactly, field.size)

    def _item(self, field: Field) -> Reader:
        if field.nested:
            return self.of(field.base)
        primitive = PRIMITIVES[field.base]
        if not primitive.size:
            text = _text if field.base == _TEXT else _wide_text
            return _bounded(text, field.string_bound) if field.string_bound else text
        return _truth if primitive.code == "?" else _number(primitive.code, primitive.size)


def _message(fields: list[tuple[str, Reader]], *, empty: bool) -> Reader:
    def read(cursor: _Cursor) -> dict[str, Any]:
        values: dict[str, Any] = {}
        name = ""
        try:
            for name, reader in fields:
                values[name] = reader(cursor)
        except _Unreadable as fault:
            fault.path.append(name)
            raise
        return {} if empty else values  # a type without fields has a dummy one, as in ROS 2

    return read


def _items(reader: Reader, least: int, exactly: int | None, most: int) -> Reader:
    def read(cursor: _Cursor) -> tuple[Any, ...]:
        values: list[Any] = []
        count = cursor.length(least, most) if exactly is None else exactly
        try:
            for _ in range(count):
                values.append(reader(cursor))  # noqa: PERF401 - a fault needs the number of items before it
        except _Unreadable as fault:
            fault.path.append(len(values))
            raise
        return tuple(values)

    return read


def _number(code: str, size: int) -> Reader:
    little, big = Struct(f"<{code}").unpack_from, Struct(f">{code}").unpack_from

    def read(cursor: _Cursor) -> Any:
        start = cursor.claim(1, size)
        return (little if cursor.little else big)(cursor.data, start)[0]

    return read


def _truth(cursor: _Cursor) -> bool:
    start = cursor.claim(1, 1)
    if cursor.data[start] > 1:
        raise _Unreadable(f"a bool is 0 or 1, not {cursor.data[start]}", start)
    return cursor.data[start] == 1


def _numbers(code: str, size: int, exactly: int | None, most: int) -> Reader:
    def read(cursor: _Cursor) -> memoryview:
        count = cursor.length(size, most) if exactly is None else exactly
        start = cursor.claim(count, size)
        view = memoryview(cursor.data)[start : cursor.offset]
        if code == "?" and (wrong := bytes(view).strip(b"\0\1")):
            raise _Unreadable(f"a bool is 0 or 1, not {wrong[0]}", cursor.data.index(wrong, start))
        if not count:
            return memoryview(_array("B" if code == "?" else code)).toreadonly()
        if cursor.little is (sys.byteorder == "little") or size == 1:
            return cast("Any", view).cast(code)
        swapped: array[Any] = _array(code, bytes(view))
        swapped.byteswap()
        return memoryview(swapped).toreadonly()

    return read


def _text(cursor: _Cursor) -> str:
    length = cursor.length(1, 0, "bytes of text")
    start = cursor.claim(length, 1)
    if length and cursor.data[cursor.offset - 1]:
        raise _Unreadable("the text does not end with a NUL", cursor.offset - 1)
    try:
        return cursor.data[start : max(start, cursor.offset - 1)].decode()
    except UnicodeDecodeError as error:
        raise _Unreadable(f"the text is not UTF-8: {error.reason}", start + error.start) from None


def _wide_text(cursor: _Cursor) -> str:
    start = cursor.claim(cursor.length(_WIDE, 0, "units of text"), _WIDE)
    try:
        return wide_text(cursor.data[start : cursor.offset], little=cursor.little)
    except (OverflowError, UnicodeDecodeError):
        raise _Unreadable("the text is not UTF-16", start) from None


def _bounded(text: Callable[[_Cursor], str], bound: int) -> Reader:
    def read(cursor: _Cursor) -> str:
        start = cursor.offset + padding(cursor.offset, 4)
        found = text(cursor)
        if len(found) > bound:
            raise _Unreadable(f"{len(found)} characters where {bound} are allowed", start)
        return found

    return read


def wide_text(data: bytes, *, little: bool) -> str:
    """Decode text of UTF-16 units in 32 bits each.

    Raises:
        OverflowError: A unit needs more than 16 bits.
        UnicodeDecodeError: A surrogate stands alone.
    """
    wide = array("I", data)
    if little is not (sys.byteorder == "little"):
        wide.byteswap()
    return array("H", wide).tobytes().decode(f"utf-16-{sys.byteorder[0]}e")
