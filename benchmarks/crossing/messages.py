"""Messages that cross: how one of a size and a number is made, and how the number is read again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.sensor_msgs import Image, Imu
from busflow.msgs.std_msgs import Header, Int64, UInt8MultiArray


@dataclass(frozen=True)
class Kind:
    """One type of message."""

    type: Any
    make: Callable[[int, int], Any]
    """Of a size, with a number."""
    number: Callable[[Any], int]
    is_shared: bool = True
    """Whether the processes may share memory for it."""


def _numbered(number: int) -> Header:
    return Header(stamp=Time(sec=number, nanosec=0), frame_id="")


KINDS = {
    "number": Kind(Int64, lambda _size, number: Int64(data=number), lambda message: message.data),
    "block": Kind(
        UInt8MultiArray,
        lambda size, number: UInt8MultiArray(data=bytes([number]) + bytes(size - 1)),
        lambda message: int(message.data[0]),
    ),
    "image": Kind(
        Image,
        lambda size, number: Image(header=_numbered(number), data=bytes(size)),
        lambda message: message.header.stamp.sec,
    ),
    "imu": Kind(Imu, lambda _size, number: Imu(header=_numbered(number)), lambda message: message.header.stamp.sec),
}
KINDS["whole image"] = replace(KINDS["image"], is_shared=False)
