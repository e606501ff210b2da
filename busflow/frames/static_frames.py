"""StaticFrames: the node behind `frames:` of a launch file, which publishes them on `/tf_static`."""

from __future__ import annotations

from math import sqrt
from typing import Annotated, Self

from pydantic import Field, model_validator

from busflow.frames.declarations import FIXED_PUBLISHER_QOS, transform_message
from busflow.frames.rigid import TOLERANCE, Rigid, from_rpy
from busflow.frames.shared import FIXED
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
    _fixed = publisher(TFMessage, FIXED, qos=FIXED_PUBLISHER_QOS)

    async def start(self) -> None:
        """Publish the frames, once: `/tf_static` keeps them for whatever comes later."""
        stamp = self.clock.now().to_msg()
        transforms = tuple(
            transform_message(parent, child, frame.numbers, stamp)
            for parent, children in self.parameters.frames.items()
            for child, frame in children.items()
        )
        self._fixed.publish(TFMessage(transforms=transforms))
