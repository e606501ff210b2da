"""`TypeSupport`: the description, hash, schema and encoding of a message class."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple, cast

import numpy as np

from busflow.errors import InvalidDeclaration, MalformedMessage
from busflow.interfaces.encoding import json_form
from busflow.interfaces.encoding.cdr import Codec
from busflow.interfaces.encoding.cdr_decoder import most_bytes
from busflow.interfaces.encoding.description import (
    SERVICE_EVENT_INFO,
    Count,
    Field,
    IndividualDescription,
    TypeDescription,
    array_text,
    assemble,
    constant,
    default_text,
    individual,
    rihs01,
    service_types,
    written,
)
from busflow.interfaces.encoding.msg_text import ENCODING, ros2msg
from busflow.interfaces.encoding.viewer_schema import recorded_definition
from busflow.interfaces.fields import ArrayKind, FieldType
from busflow.interfaces.message import (
    Message,
    ServiceType,
    UInt8Array,
    constants_of,
    fields_of,
    find_type,
    is_ros_type,
    type_name,
)

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType


class OpaqueMessage(Message, package="busflow"):
    """Bytes of a type that is known by its description alone."""

    payload: UInt8Array

    if TYPE_CHECKING:  # pydantic would take them for fields
        foreign: ClassVar[ForeignType]


def opaque(foreign: ForeignType) -> type[OpaqueMessage]:
    """Return a new class for messages of a type: a topic is identified by its class."""
    made = type("Opaque", (OpaqueMessage,), {"__module__": __name__}, package="busflow")
    made.__ros_name__ = foreign.name
    cls = cast("type[OpaqueMessage]", made)
    type.__setattr__(cls, "foreign", foreign)
    return cls


_BYTE_KINDS = {"uint8", "int8", "byte", "char"}
_COUNTS = {
    ArrayKind.NONE: Count.ONE,
    ArrayKind.FIXED: Count.FIXED,
    ArrayKind.BOUNDED: Count.BOUNDED,
    ArrayKind.UNBOUNDED: Count.UNBOUNDED,
}


class TypeSupport:
    r"""The encoding of one message class or service: CDR, or JSON if ROS cannot describe it.

    What is asked for is made then, and kept. A service has no codec: its `Request` and `Response` have theirs.

    >>> from busflow.msgs.std_msgs import String
    >>> support = TypeSupport(String)
    >>> support.name, support.encoding, support.definition
    ('std_msgs/msg/String', 'cdr', 'string data\n')
    >>> support.decode(support.encode(String(data="ahoy")))
    String(data='ahoy')
    """

    def __init__(self, cls: type[Message | ServiceType]) -> None:
        self.cls = cls
        self.name: str = type_name(cls)
        self._foreign = cls.foreign if issubclass(cls, OpaqueMessage) else None
        parts = (cls.Request, cls.Response) if issubclass(cls, ServiceType) else (cls,)
        self.is_ros: bool = self._foreign.is_ros if self._foreign else all(is_ros_type(part) for part in parts)
        self.encoding = "cdr" if self.is_ros else "json"
        """The encoding of the bytes, in MCAP's word."""
        self.definition_encoding = ENCODING if self.is_ros else "jsonschema"
        """The format of `definition`, in MCAP's word."""

    @cached_property
    def description(self) -> dict[str, Any]:
        """The definition with which a peer reads the messages, ready to be JSON: `TypeDescription` or JSON Schema."""
        if self._foreign:
            return self._foreign.description
        if self.is_ros:
            return cast("dict[str, Any]", describe(self.cls))
        if not issubclass(self.cls, ServiceType):
            return json_form.schema_of(self.cls)
        parts = {"request": self.cls.Request, "response": self.cls.Response}
        return {"type": "object", "properties": {word: json_form.schema_of(part) for word, part in parts.items()}}

    @cached_property
    def type_hash(self) -> str:
        """The hash of the type: `RIHS01_…` as ROS 2 computes it, or `JSON01_…`."""
        if self.is_ros:
            return rihs01(cast("TypeDescription", self.description))
        return json_form.type_hash(self.description)

    @cached_property
    def definition(self) -> str:
        """The description as text, as recordings hold it: the `.msg` file with those it needs, or the JSON Schema."""
        if self.is_ros:
            return ros2msg(cast("TypeDescription", self.description))
        return recorded_definition(self.description)

    @cached_property
    def encode(self) -> Callable[[Message], bytes]:
        """Encode a message. Raises MalformedMessage if a value has no encoding."""
        return self._codec.encode

    @cached_property
    def decode(self) -> Callable[[bytes | bytearray | memoryview], Message]:
        """Decode bytes to a message. Raises MalformedMessage if they are not one."""
        return self._codec.decode

    @property
    def is_heavy(self) -> bool:
        """True if a message may hold an array so large that a copy is worth avoiding."""
        return self._is_plain and _holds_arrays(cast("type[Message]", self.cls))

    @cached_property
    def is_bulky(self) -> bool:
        """True if a message is mostly bytes, and any number of them: an image, a cloud, a map."""
        fields = fields_of(self.cls) if self.is_ros and issubclass(self.cls, Message) else ()
        return any(field.array is ArrayKind.UNBOUNDED and field.base in _BYTE_KINDS for field in fields)

    @cached_property
    def most_bytes(self) -> float:
        """A size that no message of the type exceeds; infinite if a text or an array may have any length."""
        return most_bytes(cast("type[Message]", self.cls)) if self._is_plain else math.inf

    def check_size(self, size: int) -> None:
        """Check the size of an encoded message, before it is copied or decoded.

        Raises:
            MalformedMessage: No message of the type has so many bytes.
        """
        if size > self.most_bytes:
            raise MalformedMessage(f"{size:,} bytes are too many", type_name=self.name)

    @property
    def encode_in_parts(self) -> Callable[[Message], list[Any]]:
        """Encode a heavy message into parts that are not joined; a large array is a part itself."""
        return cast("Codec", self._codec).encode_in_parts

    @property
    def _is_plain(self) -> bool:
        """True for a message class that ROS can describe; its fields are those of the encoded messages."""
        return self.is_ros and not issubclass(self.cls, ServiceType | OpaqueMessage)

    @cached_property
    def _codec(self) -> Codec | _Codec:
        if issubclass(self.cls, ServiceType):
            raise InvalidDeclaration(f"{self.name} is a service; its Request and its Response are encoded")
        if issubclass(self.cls, OpaqueMessage):
            return _opaque_codec(self.cls)
        if not self.is_ros:
            return _Codec(*json_form.codec(self.cls, self.name))
        return Codec(self.cls, cast("TypeDescription", self.description))


class _Codec(NamedTuple):
    encode: Callable[[Any], bytes]
    decode: Callable[[Any], Message]


def _opaque_codec(cls: type[OpaqueMessage]) -> _Codec:
    """Return a codec that leaves bytes unchanged."""

    def encode(message: Any) -> bytes:
        return message.payload.tobytes()

    def decode(payload: bytes | bytearray | memoryview) -> Message:
        return cls(payload=np.frombuffer(bytes(payload), np.uint8))

    return _Codec(encode, decode)


def describe(cls: type[Message | ServiceType]) -> TypeDescription:
    """Return the description of a message class, or of a service.

    Raises:
        InvalidDeclaration: ROS has no word for one of its fields.
    """
    types: dict[str, IndividualDescription] = {}
    if issubclass(cls, ServiceType):
        event_info = cast("type[Message]", find_type(SERVICE_EVENT_INFO))
        for part in (cls.Request, cls.Response, event_info):
            _describe_all(part, types)
        types |= {each["type_name"]: each for each in service_types(type_name(cls))}
    else:
        _describe_all(cls, types)
    return assemble(type_name(cls), types)


def _holds_arrays(cls: type[Message]) -> bool:
    """Return whether a field of the class, or of one inside it, is an array of numbers of any length."""
    return any(
        (field.array is ArrayKind.UNBOUNDED and field.base not in {"string", "wstring"})
        if isinstance(field.base, str)
        else field.array is ArrayKind.NONE and _holds_arrays(cast("type[Message]", field.base))
        for field in fields_of(cls)
    )


def _describe_all(cls: type[Message], types: dict[str, IndividualDescription]) -> None:
    """Add the class and the classes inside it to `types`."""
    name = type_name(cls)
    if name in types:
        return
    types[name] = individual(
        name,
        [field.describe() for field in described_fields(cls)],
        [constant(each.name, each.base, written(each.value), each.above) for each in constants_of(cls)],
    )
    for field in fields_of(cls):
        if not isinstance(field.base, str):
            _describe_all(cast("type[Message]", field.base), types)


def described_fields(cls: type[Message]) -> list[Field]:
    """Return the fields of a message class in the form that codecs use.

    Raises:
        InvalidDeclaration: ROS has no word for one of them.
    """
    return [_field(field, type_name(cls)) for field in fields_of(cls)]


def _field(field: FieldType, around: str) -> Field:
    nested = not isinstance(field.base, str)
    base = type_name(cast("type[Message]", field.base)) if nested else cast("str", field.base)
    return Field(
        field.name,
        base,
        nested,
        _COUNTS[field.array],
        field.size,
        field.string_bound or 0,
        "" if nested else _default(field, around),
    )


def _default(field: FieldType, around: str) -> str:
    """Return a default as the `.msg` file of the type `around` writes it, empty where it writes none."""
    value: Any = field.default
    if value is None or field.array is ArrayKind.NONE:
        return default_text(value, field.name, around)
    values = cast("Sequence[Any]", value.tolist() if hasattr(value, "tolist") else value)
    return array_text(values, _COUNTS[field.array])
