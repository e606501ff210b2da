"""Velocities, and how they change."""

from typing import Annotated

from busflow.interfaces.message import Float64Array, Length, Message, zeros
from busflow.msgs.geometry_msgs.vectors import Vector3
from busflow.msgs.std_msgs import Header


class Twist(Message, package="geometry_msgs"):
    """A velocity."""

    linear: Vector3 = Vector3()
    """Along the axes, m/s."""
    angular: Vector3 = Vector3()
    """About the axes, rad/s."""


class Accel(Message, package="geometry_msgs"):
    """An acceleration."""

    linear: Vector3 = Vector3()
    """Along the axes, m/s²."""
    angular: Vector3 = Vector3()
    """About the axes, rad/s²."""


class TwistWithCovariance(Message, package="geometry_msgs"):
    """A velocity and how certain it is."""

    twist: Twist = Twist()
    covariance: Annotated[Float64Array, Length(36)] = zeros(36)
    """6 × 6 by rows: along x, y, z, then about the fixed x, y and z axes."""


class AccelWithCovariance(Message, package="geometry_msgs"):
    """An acceleration and how certain it is."""

    accel: Accel = Accel()
    covariance: Annotated[Float64Array, Length(36)] = zeros(36)
    """6 × 6 by rows: along x, y, z, then about the fixed x, y and z axes."""


class TwistStamped(Message, package="geometry_msgs"):
    """A velocity with its time and the frame it is expressed in."""

    header: Header = Header()
    twist: Twist = Twist()


class TwistWithCovarianceStamped(Message, package="geometry_msgs"):
    """An uncertain velocity with its time and frame."""

    header: Header = Header()
    twist: TwistWithCovariance = TwistWithCovariance()


class AccelStamped(Message, package="geometry_msgs"):
    """An acceleration with its time and frame."""

    header: Header = Header()
    accel: Accel = Accel()


class AccelWithCovarianceStamped(Message, package="geometry_msgs"):
    """An uncertain acceleration with its time and frame."""

    header: Header = Header()
    accel: AccelWithCovariance = AccelWithCovariance()


class VelocityStamped(Message, package="geometry_msgs"):
    """The velocity of one frame relative to a second, expressed in the axes of a third."""

    header: Header = Header()
    """`frame_id` is the frame whose axes are used; for the usual body twist it is the body's."""
    body_frame_id: str = ""
    """The frame that moves."""
    reference_frame_id: str = ""
    """The frame that it moves relative to."""
    velocity: Twist = Twist()
