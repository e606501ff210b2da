"""StaticFrames: the node behind `frames:` of a launch file, which publishes them on `/tf_static`."""

from __future__ import annotations

from math import sqrt
from typing import Annotated, Self

from pydantic import Field, model_validator

from busflow.bus.qos import Durability, QoS
from busflow.frames.rigid import TOLERANCE, Rigid, from_rpy
from busflow.msgs.builtin_interfaces import Time as TimeMsg
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from busflow.msgs.std_msgs import Header
from busflow.msgs.tf2_msgs import TFMessage
from busflow.node.declarations import publisher
from busflow.node.node import Node
from busflow.node.parameters import Parameters, ReadOnly

Finite = Annotated[float, Field(allow_inf_nan=False)]
Triple = Annotated[list[Finite], Field(min_length=3, max_length=3)]


class FixedFrame(Parameters):
    """Where a frame is, seen from its parent."""

    xyz: Triple = Field(default=[0.0, 0.0, 0.0], description="Its origin, in metres.")
    rpy: Triple | None = Field(default=None, description="Its roll, pitch and yaw about fixed axes, in radians.")
    quaternion: Annotated[list[Finite], Field(min_length=4, max_length=4)] | None = Field(
        default=None, description="Its rotation as x, y, z, w, in place of rpy."
    )

    @model_validator(mode="after")
    def _one_rotation(self) -> Self:
        if self.rpy is not None and self.quaternion is not None:
            raise ValueError("a rotation is stated as rpy or as quaternion, not as both")
        if self.quaternion is not None:
            squared = sum(each * each for each in self.quaternion)
            if abs(squared - 1) > TOLERANCE:
                raise ValueError(
                    f"a quaternion has the length 1, and this one {sqrt(squared):.3g}; write rpy: [0, 0, 0]"
                )
        return self

    @property
    def numbers(self) -> Rigid:
        """The frame as a motion."""
        x, y, z = self.xyz
        qx, qy, qz, qw = self.quaternion or from_rpy(*(self.rpy or (0.0, 0.0, 0.0)))
        return (x, y, z, qx, qy, qz, qw)


class StaticFramesParameters(Parameters):
    """Parameters of StaticFrames."""

    frames: ReadOnly[dict[str, dict[str, FixedFrame]]] = Field(description="The frames by parent and name.")


class StaticFrames(Node):
    """Publishes frames that never move on `/tf_static`, as `frames:` of a launch file states them."""

    parameters: StaticFramesParameters
    _fixed = publisher(TFMessage, "/tf_static", qos=QoS(depth=1, durability=Durability.TRANSIENT_LOCAL))

    async def start(self) -> None:
        """Publish the frames, once: `/tf_static` keeps them for whatever comes later."""
        stamp, stated = self.clock.now().to_msg(), self.parameters.frames.items()
        edges = (_message(parent, child, frame, stamp) for parent, below in stated for child, frame in below.items())
        self._fixed.publish(TFMessage(transforms=tuple(edges)))


def _message(parent: str, child: str, frame: FixedFrame, stamp: TimeMsg) -> TransformStamped:
    x, y, z, qx, qy, qz, qw = frame.numbers
    return TransformStamped(
        header=Header(stamp=stamp, frame_id=parent),
        child_frame_id=child,
        transform=Transform(translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw)),
    )
