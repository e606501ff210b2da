"""The processor of lab 1: balance from the IMU, warnings from the joints, and a status of both."""

from math import asin, hypot, inf

from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, Publisher, ReadOnly, publisher, subscription, timer
from busflow.msgs.geometry_msgs import Quaternion
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Float64

FAST_RAD_S = 1.0
"""A mean joint speed beyond this is worth a line in the log, rad/s."""


class SensorProcessorParameters(Parameters):
    max_joint_angle: float = Field(default=3.0, gt=0, description="Warn of a joint beyond this angle, rad.")
    timeout_s: float = Field(default=1.0, gt=0, description="A sensor silent for so long is offline, s.")
    publish_pitch: ReadOnly[bool] = Field(default=False, description="Of an IMU that measures its orientation.")


class SensorProcessor(Node):
    """Turns IMU and joint readings into balance metrics and a status."""

    parameters: SensorProcessorParameters

    balance = publisher(Float64, "balance_state")
    stability = publisher(Float64, "stability_index")

    def declare(self) -> None:
        self.pitch: Publisher[Float64] | None = None
        if self.parameters.publish_pitch:
            self.pitch = self.create_publisher(Float64, "pitch")

    async def start(self) -> None:
        self.imu_received_s = -inf  # never yet
        self.joints_received_s = -inf
        self.shown = ""

    @subscription("imu/data", qos=SENSOR_DATA)
    def on_imu(self, imu: Imu) -> None:
        self.imu_received_s = self.clock.seconds()
        rotation = hypot(imu.angular_velocity.x, imu.angular_velocity.y, imu.angular_velocity.z)
        balance = min(1.0, (abs(imu.linear_acceleration.y) + rotation) / 2.0)
        self.balance.publish(Float64(data=balance))
        self.stability.publish(Float64(data=1.0 - balance))
        if self.pitch is not None:
            self.pitch.publish(Float64(data=pitch(imu.orientation)))

    @subscription("joint_states")
    def on_joint_states(self, joints: JointState) -> None:
        self.joints_received_s = self.clock.seconds()
        limit = self.parameters.max_joint_angle
        for name, angle in zip(joints.name, joints.position.tolist(), strict=False):
            if abs(angle) > limit:
                self.log.warning("joint beyond its limit", joint=name, angle=round(angle, 3), limit=limit)
        speeds = [abs(velocity) for velocity in joints.velocity.tolist()]  # for ten of them numpy takes longer
        mean_speed = sum(speeds) / len(speeds) if speeds else 0.0
        if mean_speed > FAST_RAD_S:
            self.log.info("the joints move fast", mean_speed=round(mean_speed, 3))

    @timer(0.5)
    def tell_status(self) -> None:
        if self.status != self.shown:
            self.shown = self.status
            self.log.info(self.status)

    @property
    def status(self) -> str:
        """The sensors that send data, in one sentence."""
        imu, joints = self.is_recent(self.imu_received_s), self.is_recent(self.joints_received_s)
        if imu and joints:
            return "All sensors operational"
        if imu:
            return "IMU operational, joint sensors offline"
        if joints:
            return "Joint sensors operational, IMU offline"
        return "No sensor data received"

    def is_recent(self, received_s: float) -> bool:
        return self.clock.seconds() - received_s < self.parameters.timeout_s


def pitch(of: Quaternion) -> float:
    """Return how far something leans, rad: ahead is positive, backwards negative, whatever its heading."""
    return asin(max(-1.0, min(1.0, 2.0 * (of.w * of.y - of.z * of.x))))
