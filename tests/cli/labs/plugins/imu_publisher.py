from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, ReadOnly, publisher, timer
from busflow.msgs.sensor_msgs import Imu, JointState


class ImuPublisherParameters(Parameters):
    rate_hz: float = Field(default=10.0, ge=0.1, le=1000, description="publish rate in Hz")
    frame_id: ReadOnly[str] = Field(default="imu_link", description="frame id of the Imu message")
    joint_count: int = 10


class ImuPublisher(Node):
    """The publisher of ROS 2's lab, whose verbatim outputs are in tests/cases/ros2cli."""

    parameters: ImuPublisherParameters
    imu = publisher(Imu, "imu/data", qos=SENSOR_DATA)
    joints = publisher(JointState, "joint_states")

    @timer(hz="rate_hz")
    def tick(self) -> None:
        stamp = self.clock.now().to_msg()
        header = Imu().header.replace(stamp=stamp, frame_id=self.parameters.frame_id)
        self.imu.publish(Imu(header=header))
        count = self.parameters.joint_count
        self.joints.publish(JointState(header=header, name=[f"j{n}" for n in range(count)], position=[0.5] * count))
