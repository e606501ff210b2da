"""DDS types made of descriptions, whose samples hold the encoded message: no byte is encoded or decoded here.

Cyclone compares a type's fields with those of the other side's type where both sides describe theirs, and checks each
sample that arrives against them, so a message with wrong lengths never gets here. For that it needs the whole type.
"""

# The stubs of cyclonedds leave out what many of its functions take and return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cyclonedds.idl import make_idl_struct, types

from busflow.errors import UnknownType
from busflow.interfaces.encoding.description import Count, Field, IndividualDescription, fields_of, types_in
from busflow.wire.zenoh.keys import dds_type

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType

_PRIMITIVES: Mapping[str, Any] = {
    "bool": bool,
    "byte": types.byte,
    "char": types.uint8,
    "string": str,
    **{name: getattr(types, name) for name in ("int8", "int16", "int32", "int64", "float32", "float64")},
    **{name: getattr(types, name) for name in ("uint8", "uint16", "uint32", "uint64")},
}
_LONGEST_BOUND = 65_535
"""The largest bound of a sequence that cyclonedds can state."""
_HEADER: Mapping[str, Any] = {"guid": types.uint64, "seq": types.int64}
"""What `rmw_cyclonedds` writes before each request and response: an id of the client, and the number of its call."""


class Carriers:
    """DDS types by the hash of the type that they carry; each is made once."""

    def __init__(self) -> None:
        self._made: dict[tuple[str, bool], Any] = {}

    def of(self, type_: ForeignType, *, is_half_of_service: bool = False) -> Any:
        """Return the class of samples that carry messages of a type; `payload` is the encoded message.

        Raises:
            UnknownType: DDS, or this implementation of it, cannot describe the type.
        """
        key = type_.type_hash, is_half_of_service
        if key not in self._made:
            if not type_.is_ros:
                raise UnknownType(f"{type_.name} has fields that ROS 2 cannot describe")
            described = types_in(type_.description)
            header = _HEADER if is_half_of_service else {}
            made = _struct(described[type_.name], described, {}, header)
            self._made[key] = _carrying(made)
        return self._made[key]


def _struct(
    individual: IndividualDescription,
    described: Mapping[str, IndividualDescription],
    made: dict[str, Any],
    header: Mapping[str, Any],
) -> Any:
    name = individual["type_name"]
    if name not in made:
        fields = {field.name: _type_of(field, described, made) for field in fields_of(individual)}
        before = {key if key not in fields else f"header_{key}": kind for key, kind in header.items()}
        made[name] = make_idl_struct(name.replace("/", "_"), dds_type(name), {**before, **fields})
    return made[name]


def _type_of(field: Field, described: Mapping[str, IndividualDescription], made: dict[str, Any]) -> Any:
    if field.nested:
        one = _struct(described[field.base], described, made, {})
    elif field.base == "string" and field.string_bound:
        one = types.bounded_str[field.string_bound]
    elif field.base in _PRIMITIVES:
        one = _PRIMITIVES[field.base]
    else:
        raise UnknownType(f"DDS cannot carry {field.name}: cyclonedds has no {field.base}")
    if field.count is Count.ONE:
        return one
    if field.count is Count.FIXED:
        return types.array[one, field.size]
    if field.count is Count.BOUNDED and field.size <= _LONGEST_BOUND:
        return types.sequence[one, field.size]
    return types.sequence[one]


def _carrying(made: Any) -> Any:
    """Give a class of cyclonedds the methods by which it carries bytes.

    They are set on the class: cyclonedds takes a base class for the base of a type in IDL.
    """

    def of(cls: Any, payload: bytes, **_: Any) -> Any:
        sample = cls.__new__(cls)
        sample.payload = payload
        return sample

    def serialize(self: Any, **_: Any) -> bytes:
        return self.payload

    made.of = made.deserialize = made.deserialize_key = classmethod(of)
    made.serialize = serialize
    return made
