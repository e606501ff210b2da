"""`Codec`: messages of one class as CDR, in the form of ROS 2: XCDR1 behind a header of 4 bytes.

Both byte orders are read, little endian is written.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import Any

from busflow.errors import IncompatibleType, InvalidMessage, MalformedMessage
from busflow.interfaces.encoding.cdr_decoder import decoder
from busflow.interfaces.encoding.cdr_encoder import encoder, parts_encoder
from busflow.interfaces.encoding.cdr_layout import BIG_ENDIAN
from busflow.interfaces.encoding.description import TypeDescription
from busflow.interfaces.encoding.plain_reader import decoder_from_description
from busflow.interfaces.message import Message, type_name


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
        """Encode a message."""
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
        return MalformedMessage(f"{type(error).__name__}: {error}", type_name=name)
