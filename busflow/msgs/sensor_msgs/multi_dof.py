"""Joints with several degrees of freedom each."""

from collections.abc import Sequence

from busflow.interfaces.message import Message
from busflow.msgs.geometry_msgs import Transform, Twist, Wrench
from busflow.msgs.std_msgs import Header


class MultiDOFJointState(Message, package="sensor_msgs"):
    """The state of joints that move in several directions at once.

    Each sequence is as long as `joint_names`, or empty where nothing is known.
    """

    header: Header = Header()
    joint_names: Sequence[str] = ()
    transforms: Sequence[Transform] = ()
    """Where each joint has taken what hangs on it."""
    twist: Sequence[Twist] = ()
    wrench: Sequence[Wrench] = ()
