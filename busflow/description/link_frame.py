"""LinkFrame: the frame of a link, and its transform at each position of its joint."""

from __future__ import annotations

from busflow.description.robot import Joint, JointKind
from busflow.msgs.builtin_interfaces import Time as TimeMsg
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from busflow.msgs.std_msgs import Header


class LinkFrame:
    """The frame of a link; a joint either turns or slides, so one part of its transform is made once."""

    def __init__(self, joint: Joint, prefix: str) -> None:
        """Create a frame whose name, and that of its parent, begin with a prefix."""
        self.joint: Joint = joint
        self._parent, self._child = prefix + joint.parent, prefix + joint.child
        x, y, z, qx, qy, qz, qw = joint.origin
        self._translation, self._rotation = Vector3(x=x, y=y, z=z), Quaternion(x=qx, y=qy, z=qz, w=qw)

    def at_rest(self, stamp: TimeMsg) -> TransformStamped:
        """Return the transform of a joint that does not move."""
        return self._transform(stamp, self._translation, self._rotation)

    def at(self, position: float, stamp: TimeMsg) -> TransformStamped:
        """Return the transform at a position of the joint that decides, in rad or m."""
        if self.joint.kind is JointKind.PRISMATIC:
            x, y, z = self.joint.translation(position)
            return self._transform(stamp, Vector3(x=x, y=y, z=z), self._rotation)
        x, y, z, w = self.joint.rotation(position)
        return self._transform(stamp, self._translation, Quaternion(x=x, y=y, z=z, w=w))

    def _transform(self, stamp: TimeMsg, translation: Vector3, rotation: Quaternion) -> TransformStamped:
        return TransformStamped(
            header=Header(stamp=stamp, frame_id=self._parent),
            child_frame_id=self._child,
            transform=Transform(translation=translation, rotation=rotation),
        )
