"""A pose as a frame, for viewers and for nodes that ask for frames."""

from pydantic import Field

from busflow import Node, Parameters, ReadOnly, subscription, transforms
from busflow.msgs.geometry_msgs import PoseStamped, Transform, TransformStamped, Vector3


class PoseFrameParameters(Parameters):
    frame: ReadOnly[str] = Field(min_length=1, description="The frame that is where the poses say.")


class PoseFrame(Node):
    """Sends each pose as the transform of a frame."""

    parameters: PoseFrameParameters

    frames = transforms()

    @subscription("pose")
    def on_pose(self, message: PoseStamped) -> None:
        at = message.pose.position
        there = Transform(translation=Vector3(x=at.x, y=at.y, z=at.z), rotation=message.pose.orientation)
        self.frames.send(TransformStamped(header=message.header, child_frame_id=self.parameters.frame, transform=there))
