"""Poses: places with a direction."""

from collections.abc import Sequence
from typing import Annotated

from busflow.interfaces.message import Float64Array, Length, Message, float64, zeros
from busflow.msgs.geometry_msgs.vectors import Point, Quaternion
from busflow.msgs.std_msgs import Header


class Pose(Message, package="geometry_msgs"):
    """A position and an orientation."""

    position: Point = Point()
    orientation: Quaternion = Quaternion()


class Pose2D(Message, package="geometry_msgs"):
    """A position and an angle in the plane. ROS 2 deprecates it: use Pose."""

    x: float64 = 0.0
    y: float64 = 0.0
    theta: float64 = 0.0
    """The angle from the x axis, counter-clockwise, rad."""


class PoseWithCovariance(Message, package="geometry_msgs"):
    """A pose and how certain it is."""

    pose: Pose = Pose()
    covariance: Annotated[Float64Array, Length(36)] = zeros(36)
    """6 × 6 by rows: x, y, z, then rotation about the fixed x, y and z axes."""


class PoseArray(Message, package="geometry_msgs"):
    """Poses that share one frame."""

    header: Header = Header()
    poses: Sequence[Pose] = ()


class PoseStamped(Message, package="geometry_msgs"):
    """A pose with its time and frame."""

    header: Header = Header()
    pose: Pose = Pose()


class PoseWithCovarianceStamped(Message, package="geometry_msgs"):
    """An uncertain pose with its time and frame."""

    header: Header = Header()
    pose: PoseWithCovariance = PoseWithCovariance()
