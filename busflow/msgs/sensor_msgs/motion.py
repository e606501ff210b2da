"""Motion: inertial units, magnetometers and the joints of a robot."""

from collections.abc import Sequence
from typing import Annotated

from busflow.interfaces.message import Float64Array, Length, Message, zeros
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.std_msgs import Header


class Imu(Message, package="sensor_msgs"):
    """What an inertial measurement unit measures.

    A covariance of zeros means unknown; one that begins with -1 says that the sensor has no such measurement.
    """

    header: Header = Header()
    orientation: Quaternion = Quaternion()
    """Of the sensor's frame relative to the world."""
    orientation_covariance: Annotated[Float64Array, Length(9)] = zeros(9)
    """3 × 3 by rows, about x, y and z, rad²."""
    angular_velocity: Vector3 = Vector3()
    """About the axes of the sensor's frame, rad/s."""
    angular_velocity_covariance: Annotated[Float64Array, Length(9)] = zeros(9)
    """3 × 3 by rows, about x, y and z."""
    linear_acceleration: Vector3 = Vector3()
    """Along the axes of the sensor's frame, m/s²; a sensor at rest shows gravity, 9.8 upwards."""
    linear_acceleration_covariance: Annotated[Float64Array, Length(9)] = zeros(9)
    """3 × 3 by rows, along x, y and z."""


class MagneticField(Message, package="sensor_msgs"):
    """The magnetic field at the sensor."""

    header: Header = Header()
    """`frame_id` is the sensor's place and orientation."""
    magnetic_field: Vector3 = Vector3()
    """Along the axes of the sensor's frame, T; NaN on an axis that is not measured."""
    magnetic_field_covariance: Annotated[Float64Array, Length(9)] = zeros(9)
    """3 × 3 by rows, about x, y and z; zeros mean unknown."""


class JointState(Message, package="sensor_msgs"):
    """The state of joints at one time. Each array is as long as `name`, or empty where nothing is known."""

    header: Header = Header()
    name: Sequence[str] = ()
    """The joints, in the order of the arrays."""
    position: Float64Array = zeros()
    """rad; m for a joint that slides."""
    velocity: Float64Array = zeros()
    """rad/s; m/s for a joint that slides."""
    effort: Float64Array = zeros()
    """The torque, N·m; the force, N, for a joint that slides."""
