"""Values: wrappers around single ones."""

from busflow.interfaces.message import (
    Message,
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
)


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
