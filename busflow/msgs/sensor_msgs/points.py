"""Point clouds."""

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Float32Array, Message, UInt8Array, uint8, uint32, zeros
from busflow.msgs.geometry_msgs import Point32
from busflow.msgs.std_msgs import Header


class PointField(Message, package="sensor_msgs"):
    """One value that each point of a cloud has: where its bytes are and what they mean."""

    INT8: ClassVar[uint8] = 1
    UINT8: ClassVar[uint8] = 2
    INT16: ClassVar[uint8] = 3
    UINT16: ClassVar[uint8] = 4
    INT32: ClassVar[uint8] = 5
    UINT32: ClassVar[uint8] = 6
    FLOAT32: ClassVar[uint8] = 7
    FLOAT64: ClassVar[uint8] = 8

    name: str = ""
    """`x`, `y`, `z`, `intensity`, `rgb`, …"""
    offset: uint32 = 0
    """Bytes from the start of the point."""
    datatype: uint8 = 0
    """One of the constants."""
    count: uint32 = 0
    """How many values there are, 1 as a rule."""


class PointCloud2(Message, package="sensor_msgs"):
    """Points with any values, packed into bytes as `fields` says."""

    header: Header = Header()
    height: uint32 = 0
    """Rows of a cloud that is ordered as a picture; 1 for one that is not."""
    width: uint32 = 0
    """Points of a row."""
    fields: Sequence[PointField] = ()
    is_bigendian: bool = False
    """Whether the high byte of a wider value comes first."""
    point_step: uint32 = 0
    """Bytes of a point."""
    row_step: uint32 = 0
    """Bytes of a row."""
    data: UInt8Array = zeros()
    """`row_step * height` bytes."""
    is_dense: bool = False
    """Whether all points are valid."""


class ChannelFloat32(Message, package="sensor_msgs"):
    """One value for each point of a PointCloud."""

    name: str = ""
    """What the value is: `intensity`, `distance`, `rgb` (red, green and blue in the low 24 bits)."""
    values: Float32Array = zeros()
    """In the order of the points."""


class PointCloud(Message, package="sensor_msgs"):
    """Points with further values. ROS 2 deprecates it: use PointCloud2."""

    header: Header = Header()
    points: Sequence[Point32] = ()
    channels: Sequence[ChannelFloat32] = ()
    """The further values, each channel as long as `points`."""
