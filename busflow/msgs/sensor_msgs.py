"""`sensor_msgs`."""

from collections.abc import Sequence
from typing import Annotated

from busflow.message import Float64Array, Length, Message, UInt8Array, uint8, uint32, zeros
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.std_msgs import Header

__all__ = ["Image", "Imu", "JointState"]


class Imu(Message, package="sensor_msgs"):
    """What an inertial measurement unit measures.

    A covariance of zeros is unknown; one that begins with −1 says that there is no such measurement.
    """

    header: Header = Header()
    orientation: Quaternion = Quaternion()
    orientation_covariance: Annotated[Float64Array, Length(9)] = zeros(9)
    """3 × 3 by rows, about x, y and z, rad²."""
    angular_velocity: Vector3 = Vector3()
    """About the axes of the sensor's frame, rad/s."""
    angular_velocity_covariance: Annotated[Float64Array, Length(9)] = zeros(9)
    """3 × 3 by rows, about x, y and z."""
    linear_acceleration: Vector3 = Vector3()
    """Along the axes of the sensor's frame, m/s²; at rest gravity shows as 9.8 upwards."""
    linear_acceleration_covariance: Annotated[Float64Array, Length(9)] = zeros(9)
    """3 × 3 by rows, along x, y and z."""


class JointState(Message, package="sensor_msgs"):
    """The state of joints: each array is as long as `name`, or empty where nothing is known."""

    header: Header = Header()
    name: Sequence[str] = ()
    position: Float64Array = zeros()
    """rad, or m for a joint that slides."""
    velocity: Float64Array = zeros()
    """rad/s or m/s."""
    effort: Float64Array = zeros()
    """N·m or N."""


class Image(Message, package="sensor_msgs"):
    """One picture, not compressed."""

    header: Header = Header()
    """`frame_id` is the optical frame: x to the right, y down, z out of the camera."""
    height: uint32 = 0
    """Rows."""
    width: uint32 = 0
    """Columns."""
    encoding: str = ""
    """What a pixel is: `rgb8`, `bgr8`, `mono8`, `mono16`, `32FC1`, …"""
    is_bigendian: uint8 = 0
    """1 where values of several bytes have the high byte first."""
    step: uint32 = 0
    """Bytes of a row."""
    data: UInt8Array = zeros()
    """`step` × `height` bytes, row by row."""
