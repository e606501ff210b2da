"""`geometry_msgs`: points, vectors, poses, velocities, forces and the transforms between frames.

Lengths are metres, angles radians, masses kilograms, forces newtons; frames are right-handed. A `…Stamped`
message adds the time and the frame; a `…WithCovariance` message adds how certain it is.
"""

from collections.abc import Sequence
from typing import Annotated

from busflow.interfaces.message import Float64Array, Length, Message, float32, float64, int64, zeros
from busflow.msgs.std_msgs import Header

__all__ = [
    "Accel",
    "AccelStamped",
    "AccelWithCovariance",
    "AccelWithCovarianceStamped",
    "Inertia",
    "InertiaStamped",
    "Point",
    "Point32",
    "PointStamped",
    "Polygon",
    "PolygonInstance",
    "PolygonInstanceStamped",
    "PolygonStamped",
    "Pose",
    "Pose2D",
    "PoseArray",
    "PoseStamped",
    "PoseWithCovariance",
    "PoseWithCovarianceStamped",
    "Quaternion",
    "QuaternionStamped",
    "Transform",
    "TransformStamped",
    "Twist",
    "TwistStamped",
    "TwistWithCovariance",
    "TwistWithCovarianceStamped",
    "Vector3",
    "Vector3Stamped",
    "VelocityStamped",
    "Wrench",
    "WrenchStamped",
]


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


class Transform(Message, package="geometry_msgs"):
    """The transform from one frame to another: rotate, then move."""

    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


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


class Wrench(Message, package="geometry_msgs"):
    """A force and a torque on a body."""

    force: Vector3 = Vector3()
    """Along the axes, N."""
    torque: Vector3 = Vector3()
    """About the axes, N·m."""


class Inertia(Message, package="geometry_msgs"):
    """The mass of a body and its distribution."""

    m: float64 = 0.0
    """The mass, kg."""
    com: Vector3 = Vector3()
    """The centre of mass, m."""
    ixx: float64 = 0.0
    """The entries of the symmetric inertia tensor are about the centre of mass, kg·m²."""
    ixy: float64 = 0.0
    ixz: float64 = 0.0
    iyy: float64 = 0.0
    iyz: float64 = 0.0
    izz: float64 = 0.0


class Polygon(Message, package="geometry_msgs"):
    """A closed outline: the last point joins the first."""

    points: Sequence[Point32] = ()


class PolygonInstance(Message, package="geometry_msgs"):
    """A polygon with an identifier."""

    polygon: Polygon = Polygon()
    id: int64 = 0


class PoseWithCovariance(Message, package="geometry_msgs"):
    """A pose and how certain it is."""

    pose: Pose = Pose()
    covariance: Annotated[Float64Array, Length(36)] = zeros(36)
    """6 × 6 by rows: x, y, z, then rotation about the fixed x, y and z axes."""


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


class PoseArray(Message, package="geometry_msgs"):
    """Poses that share one frame."""

    header: Header = Header()
    poses: Sequence[Pose] = ()


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


class PoseStamped(Message, package="geometry_msgs"):
    """A pose with its time and frame."""

    header: Header = Header()
    pose: Pose = Pose()


class PoseWithCovarianceStamped(Message, package="geometry_msgs"):
    """An uncertain pose with its time and frame."""

    header: Header = Header()
    pose: PoseWithCovariance = PoseWithCovariance()


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


class WrenchStamped(Message, package="geometry_msgs"):
    """A wrench with its time and frame."""

    header: Header = Header()
    wrench: Wrench = Wrench()


class InertiaStamped(Message, package="geometry_msgs"):
    """An inertia with its time and frame."""

    header: Header = Header()
    inertia: Inertia = Inertia()


class PolygonStamped(Message, package="geometry_msgs"):
    """A polygon with its time and frame."""

    header: Header = Header()
    polygon: Polygon = Polygon()


class PolygonInstanceStamped(Message, package="geometry_msgs"):
    """A polygon of its own identity with its time and frame."""

    header: Header = Header()
    polygon: PolygonInstance = PolygonInstance()


class TransformStamped(Message, package="geometry_msgs"):
    """The transform from a child frame to its parent at a time, for a tree of frames."""

    header: Header = Header()
    """`frame_id` is the parent frame."""
    child_frame_id: str = ""
    """The child frame."""
    transform: Transform = Transform()


class VelocityStamped(Message, package="geometry_msgs"):
    """The velocity of one frame relative to a second, expressed in the axes of a third."""

    header: Header = Header()
    """`frame_id` is the frame whose axes are used; for the usual body twist it is the body's."""
    body_frame_id: str = ""
    """The frame that moves."""
    reference_frame_id: str = ""
    """The frame that it moves relative to."""
    velocity: Twist = Twist()
