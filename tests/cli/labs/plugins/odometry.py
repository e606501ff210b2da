from busflow import Node, timer, transforms
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from busflow.msgs.std_msgs import Header


class Odometry(Node):
    """Sends odom → base_link at 50 Hz, 2 m ahead and turned to the left."""

    frames = transforms()

    @timer(hz=50)
    def tick(self) -> None:
        there = Transform(translation=Vector3(x=2.0), rotation=Quaternion(z=0.5**0.5, w=0.5**0.5))
        header = Header(stamp=self.clock.now().to_msg(), frame_id="odom")
        self.frames.send(TransformStamped(header=header, child_frame_id="base_link", transform=there))
