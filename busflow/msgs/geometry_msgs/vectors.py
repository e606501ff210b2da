"""Vectors: directions, points and rotations."""

from busflow.interfaces.message import Message, float32, float64
from busflow.msgs.std_msgs import Header


class Vector3(Message, package="geometry_msgs"):
    """A direction with a length. Transforming it rotates it; it has no place that could be moved."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


class Point(Message, package="geometry_msgs"):
    """A place in space, m."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


class Point32(Message, package="geometry_msgs"):
    """A place in space in half the memory, m; for clouds of many points. Elsewhere use Point."""

    x: float32 = 0.0
    y: float32 = 0.0
    z: float32 = 0.0


class Quaternion(Message, package="geometry_msgs"):
    """An orientation as a unit quaternion; the default is no rotation."""

    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0
    """The real part."""


class Vector3Stamped(Message, package="geometry_msgs"):
    """A vector with its time and frame."""

    header: Header = Header()
    vector: Vector3 = Vector3()


class PointStamped(Message, package="geometry_msgs"):
    """A point with its time and frame."""

    header: Header = Header()
    point: Point = Point()


class QuaternionStamped(Message, package="geometry_msgs"):
    """An orientation with its time and the frame it is relative to."""

    header: Header = Header()
    quaternion: Quaternion = Quaternion()
