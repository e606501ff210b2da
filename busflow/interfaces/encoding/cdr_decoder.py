"""Decoding: the function that turns CDR of one byte order into messages of one class.

It is generated for the class, as its counterpart in `cdr_encoder.py`. The values that it reads have the type and range
of their fields, so messages are built without another check; those of classes with rules of their own are constructed
as usual. `plain_reader.py` says which bytes are a message. The function refuses the same bytes, but without a reason:
that is found by reading them once more.

Sequences of numbers are read-only arrays, views of the message's bytes: no copy of an image or a point cloud is made.
Only numbers of 8 bytes are copied: the header puts them 4 bytes off their alignment, where each operation on them takes
longer by what the copy costs, and where code in C may not accept them.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from struct import Struct
from typing import Any, cast

import numpy as np
from pydantic import BaseModel

from busflow.interfaces import fields
from busflow.interfaces.codegen import FunctionSource, word
from busflow.interfaces.constructor import blank, has_rules
from busflow.interfaces.encoding.cdr_encoder import FAULTS, SMALL
from busflow.interfaces.encoding.cdr_layout import HEADER_SIZE, SPARE, Item, alignment, packed
from busflow.interfaces.encoding.description import PRIMITIVES
from busflow.interfaces.encoding.plain_reader import wide_text
from busflow.interfaces.fields import ArrayKind, FieldType
from busflow.interfaces.message import Message, fields_of
from busflow.interfaces.sequences import FieldArray, FieldTuple

_ORDERS = {"little": "<", "big": ">"}
_HEADERS = {"little": 0x0100, "big": 0}
"""The header of each byte order, as a number in that order."""
_TRUTH = (False, True)


def decoder(
    cls: type[Message], order: str, other: Callable[[Any], Message], explain: Callable[[bytes, Exception], Exception]
) -> Callable[[Any], Message]:
    """Return the function that decodes messages of `cls` in the byte order "little" or "big".

    Anything but `bytes` with the header of this order goes to `other`; `explain` makes the error that is raised for a
    message that cannot be read.
    """
    return _Decoder(cls, order).function(other, explain)


@dataclass(frozen=True, slots=True)
class _Small:
    """A small array of fixed length: its bytes, and the expression of a new array.

    An array is used again while its bytes are the same, e.g. the covariances of an IMU.
    """

    raw: str
    array: str


@dataclass(frozen=True, slots=True)
class _Parts:
    """A message that is read but not yet built: its fields as expressions, or as messages of this kind."""

    cls: type[Message]
    fields: tuple[tuple[str, str | _Small | _Parts], ...]


class _Decoder:
    """The decoder under construction: its offset in the message, and the values that it has not read yet."""

    def __init__(self, cls: type[Message], order: str) -> None:
        self._cls = cls
        self._order = order
        self._source = FunctionSource()
        self._at: int | None = 0
        """The offset where it is known; elsewhere the function counts it in `offset`."""
        self._is_even = False
        """Whether `offset` is known to be a multiple of 4, as behind most numbers."""
        self._run, self._names = [Item("H2x", 1, HEADER_SIZE)], ["header"]
        """The values that the next format will unpack, and their names."""
        self._blanks: dict[type[Message], type[BaseModel]] = {}

    def function(
        self, other: Callable[[Any], Message], explain: Callable[[bytes, Exception], Exception]
    ) -> Callable[[Any], Message]:
        source, give = self._source, self._source.give
        self._elsewhere = f"    return {give(other)}(data)"
        source.add(f"if data.__class__ is not {give(bytes)}:", self._elsewhere, "try:")
        source.indent(1)
        parts = self._message(self._cls)
        self._unpack()
        source.add(f"if {self._size} > {self._offset} + {SPARE}:", f"    raise {self._fault}")
        source.add(f"return {self._made(parts)}")
        source.indent(-1)
        source.add(f"except {give(FAULTS)} as error:", f"    raise {give(explain)}(data, error) from None")
        return source.function("data")

    @property
    def _offset(self) -> str:
        return "offset" if self._at is None else str(self._at)

    @property
    def _size(self) -> str:
        return f"{self._source.give(len)}(data)"

    @property
    def _fault(self) -> str:
        return self._source.give(ValueError)

    def _message(self, cls: type[Message]) -> _Parts:
        fields = fields_of(cls)
        if not fields:
            self._run.append(Item("x", 1, 1))
        return _Parts(cls, tuple((field.name, self._field(field)) for field in fields))

    def _field(self, field: FieldType) -> str | _Small | _Parts:
        if field.array is ArrayKind.NONE:
            return self._item(field)
        fixed = field.array is ArrayKind.FIXED
        if isinstance(field.base, str) and PRIMITIVES[field.base].size:
            size = PRIMITIVES[field.base].size * field.size
            if fixed and size <= SMALL:
                raw = self._value(f"{size}s", PRIMITIVES[field.base].size, size)
                return _Small(raw, self._array(field.base, str(field.size), raw))
            return self._numbers(field.base, str(field.size) if fixed else self._count(field), fixed=fixed)
        count = str(field.size) if fixed else self._count(field)
        if field.base == "string" and field.string_bound is None:
            return self._texts(count, fixed=fixed)
        return self._each(field, count)

    def _item(self, field: FieldType) -> str | _Parts:
        if not isinstance(field.base, str):
            return self._message(cast("type[Message]", field.base))
        primitive = PRIMITIVES[field.base]
        if not primitive.size:
            return self._text(field)
        if primitive.code == "?":
            return f"{self._source.give(_TRUTH)}[{self._value('B', 1, 1)}]"
        return self._value(primitive.code, primitive.size, primitive.size)

    def _value(self, code: str, alignment: int, size: int) -> str:
        """Return a name for a value of the next run."""
        self._run.append(Item(code, alignment, size))
        self._names.append(self._source.new("value"))
        return self._names[-1]

    def _count(self, field: FieldType) -> str:
        count = self._value("I", 4, 4)
        self._unpack()
        if field.array is ArrayKind.BOUNDED:
            self._source.add(f"if {count} > {field.size}:", f"    raise {self._fault}")
        return count

    def _text(self, field: FieldType) -> str:
        source = self._source
        count = self._value("I", 4, 4)
        self._unpack()
        wide = field.base == "wstring"
        name = source.new("text")
        start = self._start()
        if wide:
            self._take(start, f"{count} * 4")
            little = source.give(self._order == "little")
            source.add(f"{name} = {source.give(wide_text)}(data[{start}:offset], little={little})")
        else:
            # Beyond the end this is an IndexError. A length of 0 looks at its own last byte, which is 0 then.
            source.add(f"offset = {start} + {count}", "if data[offset - 1]:", f"    raise {self._fault}")
            source.add(f"{name} = data[{start}:offset - 1].decode()")
        if field.string_bound is not None:
            source.add(f"if {source.give(len)}({name}) > {field.string_bound}:", f"    raise {self._fault}")
        self._at, self._is_even = None, False
        return name

    def _start(self) -> str:
        """Return the name for the present offset when it is about to change."""
        if self._at is not None:
            return str(self._at)
        self._source.add("start = offset")
        return "start"

    def _take(self, start: str, size: str) -> None:
        """Advance by `size` bytes, and check that they exist."""
        self._source.add(f"offset = {start} + {size}", f"if offset > {self._size}:", f"    raise {self._fault}")
        self._at, self._is_even = None, False

    def _numbers(self, base: str, count: str, *, fixed: bool) -> str:
        source, give, size = self._source, self._source.give, PRIMITIVES[base].size
        self._unpack()
        if size == 8 or fixed:  # else the length before it has aligned it
            gap = f"({HEADER_SIZE} - {self._offset} & {size - 1})"
            source.add(f"start = {self._offset} + {gap} if {count} else {self._offset}")
        else:
            source.add(f"start = {self._offset}")
        source.add(f"offset = start + {count} * {size}")  # beyond the end numpy raises
        self._at, self._is_even = None, size >= 4
        name, dtype = source.new("array"), _dtype_of(base)
        if size < 8 and base != "bool" and (self._order == sys.byteorder or size == 1):
            source.add(f"{name} = {give(FieldArray)}({count}, {give(dtype)}, data, start)")
        else:
            source.add(f"{name} = {self._array(base, count, 'data[start:offset]')}")
        return name

    def _array(self, base: str, count: str, data: str) -> str:
        """Return the expression of an array whose memory is the bytes `data`."""
        give, dtype = self._source.give, _dtype_of(base)
        if base == "bool":
            data = f"{give(_truths)}({data})"
        elif PRIMITIVES[base].size > 1 and self._order != sys.byteorder:
            data = f"{give(_swapped)}({data}, {give(dtype)})"
        return f"{give(FieldArray)}({count}, {give(dtype)}, {data})"

    def _each(self, field: FieldType, count: str) -> str:
        """Decode item after item."""
        source, give = self._source, self._source.give
        self._unpack()
        source.add(f"if {count} * {_least(field)} > {self._size} - {self._offset}:", f"    raise {self._fault}")
        if self._at is not None:
            source.add(f"offset = {self._at}")
        self._at, self._is_even = None, False
        items, append = source.new("items"), source.new("append")
        # Most are empty: a list and a loop would cost more than the rest.
        source.add(f"{items} = {give(FieldTuple())}", f"if {count}:")
        source.indent(1)
        source.add(f"{items} = []", f"{append} = {items}.append")
        with source.loop(f"for _ in {give(range)}({count}):"):
            item = self._item(field)
            self._unpack()
            source.add(f"{append}({self._made(item)})")
        self._is_even = False
        source.add(f"{items} = {give(FieldTuple)}({items})")
        source.indent(-1)
        return items

    def _texts(self, count: str, *, fixed: bool) -> str:
        """Decode several texts, e.g. names of joints; equal bytes as in the message before give the same tuple."""
        source, give, name = self._source, self._source.give, self._source.new("texts")
        self._unpack()
        size, known = Struct(f"{_ORDERS[self._order]}I").unpack_from, give([(0, b"", FieldTuple[str]())])
        begin = f"{self._offset} + (-{self._offset} & 3)" if fixed else self._offset  # else their number has aligned it
        source.add(
            f"start = {begin}",
            f"former, encoded, {name} = {known}[0]",  # one tuple, because other threads decode too
            f"if {count} == former and data.startswith(encoded, start):",
            f"    offset = start + {give(len)}(encoded)",
            "else:",
            f"    {name}, offset = {give(_texts)}(data, start, {count}, {give(size)})",
            f"    {known}[0] = {count}, data[start:offset], {name}",
        )
        self._at, self._is_even = None, False
        return name

    def _unpack(self) -> None:
        """Unpack the pending values."""
        run, source = self._run, self._source
        if not run:
            return
        target = f"{', '.join(self._names)}, = " if self._names else ""
        order, strictest = _ORDERS[self._order], alignment(run)
        if self._at is None and run[0].alignment == strictest > (4 if self._is_even else 1):
            source.add(f"offset += {HEADER_SIZE} - offset & {strictest - 1}")
        if self._at is not None or run[0].alignment == strictest:
            format_ = packed(run, HEADER_SIZE if self._at is None else self._at, order)
            source.add(f"{target}{source.give(format_.unpack_from)}(data, {self._offset})")
            if self._at is None:
                source.add(f"offset += {format_.size}")
            else:
                self._at += format_.size
        else:
            formats = [packed(run, offset, order) for offset in range(8)]
            unpacks = source.give([each.unpack_from for each in formats])
            sizes = source.give([each.size for each in formats])
            source.add(f"{target}{unpacks}[offset & 7](data, offset)", f"offset += {sizes}[offset & 7]")
        if self._names[:1] == ["header"]:
            source.add(f"if header != {_HEADERS[self._order]}:", self._elsewhere)
        self._is_even = run[-1].alignment >= 4 and run[-1].size % 4 == 0
        self._run, self._names = [], []

    def _made(self, parts: str | _Small | _Parts) -> str:
        """Build a message or a small array, and return the name of its variable."""
        if isinstance(parts, str):
            return parts
        source, give = self._source, self._source.give
        if isinstance(parts, _Small):
            name, known = source.new("array"), give([(b"", None)])  # one tuple, because other threads decode too
            source.add(f"former, {name} = {known}[0]", f"if {parts.raw} != former:")
            source.add(f"    {name} = {parts.array}", f"    {known}[0] = {parts.raw}, {name}")
            return name
        cls = parts.cls
        if cls not in self._blanks:
            self._blanks[cls] = blank()
        fields = [(name, self._made(value)) for name, value in parts.fields]
        name = source.new("message")
        if has_rules(cls, Message):
            source.add(f"{name} = {give(cls)}({', '.join(f'{word(field)}={value}' for field, value in fields)})")
            return name
        source.add(
            f"{name} = {give(object.__new__)}({give(self._blanks[cls])})",
            *(f"{name}.{word(field)} = {value}" for field, value in fields),
            f"{name}.__class__ = {give(cls)}",
        )
        return name


def _least(field: FieldType) -> int:
    """Return the fewest bytes that one item of a field takes, padding left out."""
    if isinstance(field.base, str):
        return PRIMITIVES[field.base].size or 4
    fields = fields_of(cast("type[Message]", field.base))
    counts = {ArrayKind.NONE: 1, ArrayKind.BOUNDED: 0, ArrayKind.UNBOUNDED: 0}
    return sum(_least(each) * counts.get(each.array, each.size) or 4 for each in fields) or 1


def most_bytes(cls: type[Message]) -> float:
    """Return a size that no message of `cls` exceeds; infinite if a text or an array may have any length."""
    return HEADER_SIZE + SPARE + sum(map(_most, fields_of(cls)))


def _most(field: FieldType) -> float:
    """Return the most bytes that a field takes, with padding and a count of items before it."""
    if isinstance(field.base, str):
        item = PRIMITIVES[field.base].size or math.inf
    else:
        item = sum(map(_most, fields_of(cast("type[Message]", field.base)))) or 1
    counts = {ArrayKind.NONE: 1, ArrayKind.UNBOUNDED: math.inf}
    return 7 + 4 + item * counts.get(field.array, field.size)


def _texts(
    data: bytes, offset: int, count: int, unpack: Callable[[bytes, int], tuple[int]]
) -> tuple[FieldTuple[str], int]:
    """Return this many texts, and the offset behind them."""
    if count * 4 > len(data) - offset:
        raise ValueError
    texts: list[str] = []
    for _ in range(count):
        start = offset + (-offset & 3)
        offset = start + 4 + unpack(data, start)[0]
        if data[offset - 1]:
            raise ValueError
        texts.append(data[start + 4 : offset - 1].decode())
    return FieldTuple(texts), offset


def _truths(data: bytes) -> bytes:
    if data.strip(b"\0\1"):
        raise ValueError
    return data


def _swapped(data: bytes, dtype: np.dtype[Any]) -> bytes:
    return np.frombuffer(data, dtype).byteswap().tobytes()


def _dtype_of(base: str) -> np.dtype[Any]:
    """Return the dtype object of a primitive's arrays; numpy compares equal ones that are not identical more slowly."""
    return np.dtype(cast("type[np.generic]", fields.PRIMITIVES[base].dtype))
