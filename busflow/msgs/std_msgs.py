"""`std_msgs`: the header of stamped messages, a colour, and wrappers around single values.

A wrapper says nothing about what its number means: prefer a message of your own with named fields.
"""

from collections.abc import Sequence

from busflow.interfaces.message import (
    ByteArray,
    Float32Array,
    Float64Array,
    Int8Array,
    Int16Array,
    Int32Array,
    Int64Array,
    Message,
    UInt8Array,
    UInt16Array,
    UInt32Array,
    UInt64Array,
    byte,
    char,
    float32,
    float64,
    int8,
    int16,
    int32,
    int64,
    uint8,
    uint16,
    uint32,
    uint64,
    zeros,
)
from busflow.msgs.builtin_interfaces import Time

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


class Header(Message, package="std_msgs"):
    """The time and frame of the measurement in a message."""

    stamp: Time = Time()
    """The time of the measurement, not of sending."""
    frame_id: str = ""
    """The coordinate frame of the data."""


class Empty(Message, package="std_msgs"):
    """Nothing but the fact that it was published."""


class ColorRGBA(Message, package="std_msgs"):
    """A colour: red, green, blue and opacity, each from 0 to 1."""

    r: float32 = 0.0
    g: float32 = 0.0
    b: float32 = 0.0
    a: float32 = 0.0


class Bool(Message, package="std_msgs"):
    """One truth value."""

    data: bool = False


class Byte(Message, package="std_msgs"):
    """One octet."""

    data: byte = 0


class Char(Message, package="std_msgs"):
    """One character code, 0 to 255."""

    data: char = 0


class Float32(Message, package="std_msgs"):
    """One number of 32 bits."""

    data: float32 = 0.0


class Float64(Message, package="std_msgs"):
    """One number of 64 bits."""

    data: float64 = 0.0


class Int8(Message, package="std_msgs"):
    """One integer of 8 bits."""

    data: int8 = 0


class Int16(Message, package="std_msgs"):
    """One integer of 16 bits."""

    data: int16 = 0


class Int32(Message, package="std_msgs"):
    """One integer of 32 bits."""

    data: int32 = 0


class Int64(Message, package="std_msgs"):
    """One integer of 64 bits."""

    data: int64 = 0


class UInt8(Message, package="std_msgs"):
    """One unsigned integer of 8 bits."""

    data: uint8 = 0


class UInt16(Message, package="std_msgs"):
    """One unsigned integer of 16 bits."""

    data: uint16 = 0


class UInt32(Message, package="std_msgs"):
    """One unsigned integer of 32 bits."""

    data: uint32 = 0


class UInt64(Message, package="std_msgs"):
    """One unsigned integer of 64 bits."""

    data: uint64 = 0


class String(Message, package="std_msgs"):
    """One text."""

    data: str = ""


class MultiArrayDimension(Message, package="std_msgs"):
    """One dimension of a multi-dimensional block."""

    label: str = ""
    """The name of the dimension: `height`, `channel`."""
    size: uint32 = 0
    """The number of its items."""
    stride: uint32 = 0
    """The number of values it spans: its size times the stride of the next inner dimension."""


class MultiArrayLayout(Message, package="std_msgs"):
    """How a flat array is read as a block of several dimensions.

    Item (i, j, k) is `data[data_offset + dim[1].stride * i + dim[2].stride * j + k]`.
    """

    dim: Sequence[MultiArrayDimension] = ()
    """The dimensions, outermost first."""
    data_offset: uint32 = 0
    """How many values at the front of the array to skip."""


class ByteMultiArray(Message, package="std_msgs"):
    """A block of octets; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: ByteArray = zeros()


class Float32MultiArray(Message, package="std_msgs"):
    """A block of numbers of 32 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Float32Array = zeros()


class Float64MultiArray(Message, package="std_msgs"):
    """A block of numbers of 64 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Float64Array = zeros()


class Int8MultiArray(Message, package="std_msgs"):
    """A block of integers of 8 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Int8Array = zeros()


class Int16MultiArray(Message, package="std_msgs"):
    """A block of integers of 16 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Int16Array = zeros()


class Int32MultiArray(Message, package="std_msgs"):
    """A block of integers of 32 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Int32Array = zeros()


class Int64MultiArray(Message, package="std_msgs"):
    """A block of integers of 64 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: Int64Array = zeros()


class UInt8MultiArray(Message, package="std_msgs"):
    """A block of unsigned integers of 8 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: UInt8Array = zeros()


class UInt16MultiArray(Message, package="std_msgs"):
    """A block of unsigned integers of 16 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: UInt16Array = zeros()


class UInt32MultiArray(Message, package="std_msgs"):
    """A block of unsigned integers of 32 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: UInt32Array = zeros()


class UInt64MultiArray(Message, package="std_msgs"):
    """A block of unsigned integers of 64 bits; `layout` has its dimensions."""

    layout: MultiArrayLayout = MultiArrayLayout()
    data: UInt64Array = zeros()
