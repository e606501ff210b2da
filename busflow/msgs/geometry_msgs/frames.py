"""Frames: the transforms between them."""

from busflow.interfaces.message import Message
from busflow.msgs.geometry_msgs.vectors import Quaternion, Vector3
from busflow.msgs.std_msgs import Header


class Transform(Message, package="geometry_msgs"):
    """The transform from one frame to another: rotate, then move."""

    translation: Vector3 = Vector3()
    rotation: Quaternion = Quaternion()


class TransformStamped(Message, package="geometry_msgs"):
    """The transform from a child frame to its parent at a time, for a tree of frames."""

    header: Header = Header()
    """`frame_id` is the parent frame."""
    child_frame_id: str = ""
    """The child frame."""
    transform: Transform = Transform()
