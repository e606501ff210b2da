from busflow import Node, publisher, timer
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped
from busflow.msgs.std_msgs import Header
from busflow.msgs.tf2_msgs import TFMessage


class Foreign(Node):
    """Knows nothing of frames, and publishes what is wrong in every way."""

    tf = publisher(TFMessage, "/tf")

    @timer(hz=50)
    def tick(self) -> None:
        stamp = self.clock.now().to_msg()
        edges = ("odom", "base_link", 1.0), ("map", "wheel", 1.0), ("odom", "wheel", 1.0), ("odom", "arm", 0.0)
        for parent, child, w in edges:
            edge = TransformStamped(
                header=Header(stamp=stamp, frame_id=parent),
                child_frame_id=child,
                transform=Transform(rotation=Quaternion(w=w)),
            )
            self.tf.publish(TFMessage(transforms=(edge,)))
