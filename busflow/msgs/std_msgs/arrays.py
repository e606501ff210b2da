"""Arrays: numbers with the dimensions that they have."""

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
    uint32,
    zeros,
)


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
