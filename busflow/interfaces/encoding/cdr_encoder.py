"""Encoding: the function that turns messages of one class into little-endian CDR.

It is generated for the class: one `struct` format packs all values of fixed size up to the next text or sequence,
arrays go into the message in one copy, and the parts are joined once.
"""

from __future__ import annotations

import sys
from array import array
from collections.abc import Callable, Sequence
from struct import Struct
from struct import error as StructError  # noqa: N812 - it is an exception, whatever the standard library calls it
from typing import Any, cast

import numpy as np

from busflow.interfaces.codegen import FunctionSource, word
from busflow.interfaces.encoding.cdr_layout import HEADER, HEADER_SIZE, Item, alignment, packed, padding
from busflow.interfaces.encoding.description import PRIMITIVES
from busflow.interfaces.fields import ArrayKind, FieldType
from busflow.interfaces.message import Message, fields_of

SMALL = 1024
"""Arrays of up to so many bytes are copied where that makes the code simpler."""

_SIZE = Struct("<I")
_ENDS = (bytes(1), bytes(4), bytes(3), bytes(2))
"""The bytes between a text and the next one, by the size of the text: its NUL and the gap."""

FAULTS = (StructError, ArithmeticError, AssertionError, LookupError, TypeError, ValueError, AttributeError)
"""The errors that a value that does not fit raises."""


def encoder(cls: type[Message], explain: Callable[[Any, Exception], Exception]) -> Callable[[Message], bytes]:
    """Return the function that encodes messages of `cls`; `explain` makes the error for a message that does not fit."""
    return _Encoder(cls).function(explain, b"".join)


def parts_encoder(
    cls: type[Message], explain: Callable[[Any, Exception], Exception]
) -> Callable[[Message], list[bytes | np.ndarray[Any, Any]]]:
    """Return a function like `encoder`'s that returns parts; a large array is a part itself, since it is frozen."""
    return _Encoder(cls).function(explain, list)


_Explain = Callable[[Any, Exception], Exception]


class _Encoder:
    """The encoder under construction: its offset in the message, and the values that it has not written yet."""

    def __init__(self, cls: type[Message]) -> None:
        self._cls = cls
        self._source = FunctionSource()
        self._known, self._added = HEADER_SIZE, list[str]()
        """The offset: a number, and the names of what comes on top when the function runs."""
        self._run, self._values = list[Item](), list[str]()
        """The values that the next format will pack."""
        self._parts: list[str] = []
        """The parts that the next statement will append."""
        self._appends = False

    def function(
        self, explain: Callable[[Any, Exception], Exception], join: Callable[[Any], Any]
    ) -> Callable[..., Any]:
        source, give = self._source, self._source.give
        source.add("try:")
        source.indent(1)
        self._message(self._cls, "message")
        self._pack()
        if self._appends:
            self._append()
            source.add(f"return {give(join)}(parts)")
        else:
            source.add(f"return {give(join)}(({', '.join([give(HEADER), *self._parts])},))")
        source.indent(-1)
        source.add(f"except {give(FAULTS)} as error:", f"    raise {give(explain)}(message, error) from None")
        return source.function("message")

    def _message(self, cls: type[Message], value: str) -> None:
        fields = fields_of(cls)
        values = self._source.new("fields")
        self._source.add(f"{values} = {value}.__dict__")  # a message's own attribute look-up is slower
        for field in fields:
            self._field(field, f'{values}["{word(field.name)}"]')
        if not fields:
            self._run.append(Item("x", 1, 1))

    def _field(self, field: FieldType, value: str) -> None:
        if field.array is ArrayKind.NONE:
            self._item(field, value)
            return
        name = self._source.new("items")
        self._source.add(f"{name} = {value}")
        if isinstance(field.base, str) and PRIMITIVES[field.base].size:
            self._numbers(field, name)
            return
        if field.array is not ArrayKind.FIXED:
            self._scalar("I", 4, f"{self._source.give(len)}({name})")
        if field.base == "string" and field.string_bound is None:
            self._texts(name, fixed=field.array is ArrayKind.FIXED)
        else:
            self._each(field, name)

    def _item(self, field: FieldType, value: str) -> None:
        if not isinstance(field.base, str):
            self._message(cast("type[Message]", field.base), value)
        elif PRIMITIVES[field.base].size:
            self._scalar(PRIMITIVES[field.base].code, PRIMITIVES[field.base].size, value)
        else:
            self._text(field, value)

    def _scalar(self, code: str, size: int, value: str) -> None:
        self._run.append(Item(code, size, size))
        self._values.append(value)

    def _text(self, field: FieldType, value: str) -> None:
        source, length = self._source, self._source.give(len)
        name = source.new("text")
        wide = field.base == "wstring"
        source.add(
            f"{name} = {source.give(wide_bytes)}({value})" if wide else f"{name} = {value}.encode() + {self._nul}"
        )
        units = f"{length}({name}) // 4" if wide else f"{length}({name})"
        self._scalar("I", 4, units)
        self._pack()
        self._parts.append(name)
        self._added.append(f"{length}({name})")

    def _texts(self, name: str, *, fixed: bool) -> None:
        """Encode several texts in a loop, which relies on each length being aligned."""
        source, texts = self._source, self._source.new("texts")
        self._pack()
        if fixed:  # else the length before it has aligned it
            self._align(4, name)
        source.add(f"{texts} = {source.give(_texts_encoder())}({name})")
        self._parts.append(texts)
        self._added.append(f"{source.give(len)}({texts})")

    @property
    def _nul(self) -> str:
        return self._source.give(b"\0")

    def _numbers(self, field: FieldType, name: str) -> None:
        source, base = self._source, cast("str", field.base)
        size = PRIMITIVES[base].size
        if size > 1 and sys.byteorder != "little":  # pragma: no cover  # on few machines
            source.add(f"{name} = {name}.astype({source.give(np.dtype(f'<{PRIMITIVES[base].code}'))})")
        if field.array is ArrayKind.FIXED and field.size * size <= SMALL:
            self._run.append(Item(f"{field.size * size}s", size, field.size * size))
            self._values.append(f"{name}.tobytes()")
            return
        count = source.new("count")
        source.add(f"{count} = {source.give(len)}({name})")
        if field.array is not ArrayKind.FIXED:
            self._scalar("I", 4, count)
        self._pack()
        if size == 8 or field.array is ArrayKind.FIXED:  # else the length before it has aligned it
            self._align(size, count)
        # Of a large array, the bytes are copied when all is joined, and only then.
        large = f"{count} > {SMALL} and {name}.flags.c_contiguous"
        self._parts.append(f"{name} if {large} else {name}.tobytes()")
        self._added.append(f"{count} * {size}")

    def _align(self, size: int, count: str) -> None:
        """Pad to the alignment of an array's items; an empty array needs none."""
        source = self._source
        if not self._added:
            gap = source.give(bytes(padding(self._known, size)))
        else:
            self._locate()
            gaps = source.give([bytes(padding(offset, size)) for offset in range(8)])
            gap = f"{gaps}[offset & 7]"
        name = source.new("gap")
        source.add(f"{name} = {gap} if {count} else {source.give(b'')}")
        self._parts.append(name)
        self._added.append(f"{source.give(len)}({name})")

    def _each(self, field: FieldType, name: str) -> None:
        """Encode item after item."""
        self._pack()
        self._append()
        self._locate()
        item = self._source.new("item")
        with self._source.loop(f"for {item} in {name}:"):
            self._item(field, item)
            self._pack()
            self._append()
            self._locate()

    def _pack(self) -> None:
        """Pack the pending values."""
        run, source = self._run, self._source
        if not run:
            return
        values = f"({', '.join(self._values)})"
        if not self._added or alignment(run) == 1:
            format_ = packed(run, self._known, "<")
            self._parts.append(source.give(format_.pack) + values)
            self._known += format_.size
        else:
            self._locate()
            formats = source.give([packed(run, offset, "<").pack for offset in range(8)])
            name = source.new("packed")
            source.add(f"{name} = {formats}[offset & 7]{values}")
            self._parts.append(name)
            self._added.append(f"{source.give(len)}({name})")
        self._run, self._values = [], []

    def _append(self) -> None:
        """Append the packed bytes to the list of parts, and create the list if there is none."""
        if not self._appends:
            self._source.add(f"parts = [{', '.join([self._source.give(HEADER), *self._parts])}]")
            self._appends = True
        elif self._parts:
            self._source.add(f"parts += ({', '.join(self._parts)},)")
        self._parts = []

    def _locate(self) -> None:
        """Add a line that computes the offset, unless the last line did."""
        if self._added != ["offset"] or self._known:
            self._source.add(f"offset = {' + '.join([str(self._known), *self._added])}")
        self._known, self._added = 0, ["offset"]


def _texts_encoder() -> Callable[[Sequence[str]], bytes]:
    """Return a function that encodes the texts of a field and caches the last result: names of joints stay the same."""
    known: tuple[Sequence[str], bytes] = ((), b"")  # one tuple, because other threads encode too

    def encode(texts: Sequence[str]) -> bytes:
        nonlocal known
        former, encoded = known
        if texts is not former and tuple(texts) != tuple(former):
            encoded = _texts(texts)
            known = (texts, encoded)
        return encoded

    return encode


def _texts(texts: Sequence[str]) -> bytes:
    """Encode texts one after the other, with padding between them."""
    parts: list[bytes] = []
    for text in texts:
        data = text.encode()
        size = len(data) + 1
        parts += (_SIZE.pack(size), data, _ENDS[size & 3])
    parts[-1:] = [b"\0"] if parts else []
    return b"".join(parts)


def wide_bytes(text: str) -> bytes:
    """Encode text as UTF-16 with 32 bits for each unit, as ROS 2 does."""
    return np.array(array("H", text.encode(f"utf-16-{sys.byteorder[0]}e")), "<u4").tobytes()
