"""`Codec`: messages of one class as CDR, in the form of ROS 2: XCDR1 behind a header of 4 bytes.

Both byte orders are read, little endian is written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cached_property
from typing import Any, cast

from busflow.errors import IncompatibleType, InvalidMessage, KeyPath, MalformedMessage
from busflow.interfaces.encoding.cdr_decoder import decoder
from busflow.interfaces.encoding.cdr_encoder import encoder, parts_encoder
from busflow.interfaces.encoding.cdr_layout import BIG_ENDIAN
from busflow.interfaces.encoding.description import TypeDescription
from busflow.interfaces.encoding.plain_reader import decoder_from_description
from busflow.interfaces.fields import ArrayKind
from busflow.interfaces.message import Message, fields_of, type_name


class Codec:
    """Encodes and decodes messages of one class.

    >>> from busflow.msgs.std_msgs import Int32
    >>> from busflow.interfaces.encoding.typesupport import describe
    >>> codec = Codec(Int32, describe(Int32))
    >>> codec.encode(Int32(data=7)).hex(" ", 4), codec.decode(bytes.fromhex("0000000000000007"))
    ('00010000 07000000', Int32(data=7))
    """

    def __init__(self, cls: type[Message], description: TypeDescription) -> None:
        self._cls = cls
        self._description = description
        self._big: Callable[[bytes], Message] | None = None

    @cached_property
    def encode(self) -> Callable[[Message], bytes]:
        """Encode a message. Raises MalformedMessage if a text is too long for ROS 2, which bounds its bytes."""
        return encoder(self._cls, self._explain_value)

    @cached_property
    def decode(self) -> Callable[[bytes | bytearray | memoryview], Message]:
        """Decode bytes to a message whose arrays are views of them. Raises MalformedMessage if they are not one."""
        return decoder(self._cls, "little", self._decode_other, self._explain_bytes)

    @cached_property
    def encode_in_parts(self) -> Callable[[Message], list[Any]]:
        """Encode a message into parts that `encode` joins; a large array is a part itself and is not copied."""
        return parts_encoder(self._cls, self._explain_value)

    def _decode_other(self, data: bytes | bytearray | memoryview) -> Message:
        """Decode bytes in another kind of memory, or with another header."""
        if type(data) is not bytes:
            return self.decode(bytes(data))
        if data[:2] != BIG_ENDIAN:
            raise self._explain_bytes(data, ValueError())
        if self._big is None:
            self._big = decoder(self._cls, "big", self._decode_other, self._explain_bytes)
        return self._big(data)

    def _explain_bytes(self, data: bytes, error: Exception) -> Exception:
        if isinstance(error, MalformedMessage):
            return error
        name = type_name(self._cls)
        try:
            decoder_from_description(self._description)(data)
        except MalformedMessage as found:
            return found
        if isinstance(error, InvalidMessage):  # the bytes are a message, and the class has rules against it
            first = error.faults[0]
            return MalformedMessage(first.message, type_name=name, path=first.path)
        return MalformedMessage(f"{type(error).__name__}: {error}", type_name=name)

    def _explain_value(self, message: Any, error: Exception) -> Exception:
        name = type_name(self._cls)
        if not isinstance(message, self._cls):
            return IncompatibleType(f"a {type(message).__name__} is no {name}")
        for path, text, bound, wide in _bounded_texts(self._cls, message, ()):
            size = len(text.encode("utf-16-le")) // 2 if wide else len(text.encode())
            if size > bound:
                unit = "units of UTF-16" if wide else "bytes of UTF-8"
                return MalformedMessage(f"{size} {unit} where ROS allows {bound}", type_name=name, path=path)
        return MalformedMessage(f"{type(error).__name__}: {error}", type_name=name)


def _bounded_texts(cls: type[Message], message: Message, path: KeyPath) -> Iterator[tuple[KeyPath, str, int, bool]]:
    """Yield each bounded text of a message: its path, its bound, and whether it is wide."""
    for field in fields_of(cls):
        value: Any = getattr(message, field.name)
        where = (*path, field.name)
        items = (
            [(where, value)] if field.array is ArrayKind.NONE else [((*where, i), each) for i, each in enumerate(value)]
        )
        for place, item in items:
            if not isinstance(field.base, str):
                yield from _bounded_texts(cast("type[Message]", field.base), item, place)
            elif field.string_bound is not None:
                yield place, item, field.string_bound, field.base == "wstring"
