"""`trajectory_msgs`: where the joints of a robot should be, and when."""

from collections.abc import Sequence

from busflow.interfaces.message import Float64Array, Message, zeros
from busflow.msgs import export_types
from busflow.msgs.builtin_interfaces import Duration
from busflow.msgs.geometry_msgs import Transform, Twist
from busflow.msgs.std_msgs import Header


class JointTrajectoryPoint(Message, package="trajectory_msgs"):
    """What the joints should do at one time; positions, with velocities and accelerations or with efforts.

    Each array follows the joint names of the trajectory, or is empty.
    """

    positions: Float64Array = zeros()
    """From the joint's zero, rad; m for a joint that slides."""
    velocities: Float64Array = zeros()
    """rad/s; m/s for a joint that slides."""
    accelerations: Float64Array = zeros()
    """rad/s²; m/s² for a joint that slides."""
    effort: Float64Array = zeros()
    """The torque, N·m; the force, N, for a joint that slides."""
    time_from_start: Duration = Duration()
    """When to be there, from the start of the trajectory."""


class JointTrajectory(Message, package="trajectory_msgs"):
    """A way for joints to go."""

    header: Header = Header()
    """`stamp` is when the trajectory starts; 0 means at once."""
    joint_names: Sequence[str] = ()
    """The joints, in the order of the points' arrays."""
    points: Sequence[JointTrajectoryPoint] = ()


class MultiDOFJointTrajectoryPoint(Message, package="trajectory_msgs"):
    """What joints that move in several directions should do at one time.

    Each sequence follows the joint names of the trajectory, or is empty.
    """

    transforms: Sequence[Transform] = ()
    velocities: Sequence[Twist] = ()
    """Of the joint's origin."""
    accelerations: Sequence[Twist] = ()
    """Of the joint's origin, m/s² and rad/s²."""
    time_from_start: Duration = Duration()
    """When to be there, from the start of the trajectory."""


class MultiDOFJointTrajectory(Message, package="trajectory_msgs"):
    """A way to go for joints that move in several directions."""

    header: Header = Header()
    """`stamp` is when the trajectory starts; 0 means at once."""
    joint_names: Sequence[str] = ()
    """The joints, in the order of the points' sequences."""
    points: Sequence[MultiDOFJointTrajectoryPoint] = ()


export_types(globals())
