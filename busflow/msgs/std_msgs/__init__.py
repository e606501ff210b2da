"""`std_msgs`: the header of stamped messages, a colour, and wrappers around single values; one file per kind.

A wrapper says nothing about what its number means: prefer a message of your own with named fields.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from busflow.msgs import read_on_demand

if TYPE_CHECKING:
    from busflow.msgs.std_msgs.arrays import (
        ByteMultiArray,
        Float32MultiArray,
        Float64MultiArray,
        Int8MultiArray,
        Int16MultiArray,
        Int32MultiArray,
        Int64MultiArray,
        MultiArrayDimension,
        MultiArrayLayout,
        UInt8MultiArray,
        UInt16MultiArray,
        UInt32MultiArray,
        UInt64MultiArray,
    )
    from busflow.msgs.std_msgs.header import ColorRGBA, Empty, Header
    from busflow.msgs.std_msgs.values import (
        Bool,
        Byte,
        Char,
        Float32,
        Float64,
        Int8,
        Int16,
        Int32,
        Int64,
        String,
        UInt8,
        UInt16,
        UInt32,
        UInt64,
    )

_KINDS = {
    "header": (
        "Header",
        "Empty",
        "ColorRGBA",
    ),
    "values": (
        "Bool",
        "Byte",
        "Char",
        "Float32",
        "Float64",
        "Int8",
        "Int16",
        "Int32",
        "Int64",
        "UInt8",
        "UInt16",
        "UInt32",
        "UInt64",
        "String",
    ),
    "arrays": (
        "MultiArrayDimension",
        "MultiArrayLayout",
        "ByteMultiArray",
        "Float32MultiArray",
        "Float64MultiArray",
        "Int8MultiArray",
        "Int16MultiArray",
        "Int32MultiArray",
        "Int64MultiArray",
        "UInt8MultiArray",
        "UInt16MultiArray",
        "UInt32MultiArray",
        "UInt64MultiArray",
    ),
}
_HOMES = {name: kind for kind, names in _KINDS.items() for name in names}

__all__ = [
    "Bool",
    "Byte",
    "ByteMultiArray",
    "Char",
    "ColorRGBA",
    "Empty",
    "Float32",
    "Float32MultiArray",
    "Float64",
    "Float64MultiArray",
    "Header",
    "Int8",
    "Int8MultiArray",
    "Int16",
    "Int16MultiArray",
    "Int32",
    "Int32MultiArray",
    "Int64",
    "Int64MultiArray",
    "MultiArrayDimension",
    "MultiArrayLayout",
    "String",
    "UInt8",
    "UInt8MultiArray",
    "UInt16",
    "UInt16MultiArray",
    "UInt32",
    "UInt32MultiArray",
    "UInt64",
    "UInt64MultiArray",
]


__getattr__: Callable[[str], Any] = read_on_demand(__name__, _HOMES)  # a Header needs no array


def __dir__() -> list[str]:
    return [*globals(), *__all__]
