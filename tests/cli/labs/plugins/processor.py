from busflow import SENSOR_DATA, Node, publisher, subscription
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Float64


class Processor(Node):
    """Its processor."""

    balance = publisher(Float64, "balance_state")
    stability = publisher(Float64, "stability_index")
    said = False

    @subscription("imu/data", qos=SENSOR_DATA)
    def on_imu(self, _imu: Imu) -> None:
        self.balance.publish(Float64(data=0.25))
        self.stability.publish(Float64(data=0.75))
        if not self.said:
            self.said = True
            self.log.info("works", path="\x1b[31m")

    @subscription("joint_states")
    def on_joints(self, joints: JointState) -> None:
        pass
