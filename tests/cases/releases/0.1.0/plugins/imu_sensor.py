"""A simulated IMU, of which a robot may have several."""

from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, ReadOnly, publisher, timer
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_msgs import Header

GRAVITY = 9.8
"""The upward acceleration measured at rest, m/s²."""


class ImuSensorParameters(Parameters):
    rate_hz: float = Field(default=100.0, ge=0, le=1000, description="How often the IMU is published; 0 is off.")
    noise: float = Field(default=0.1, ge=0, le=10, description="n: ±n m/s² along each axis, ±n/2 rad/s about it.")
    frame_id: ReadOnly[str] = Field(default="imu_link", description="The IMU's frame.")


class ImuSensor(Node):
    """Publishes the readings of an IMU in an upright body, with noise."""

    parameters: ImuSensorParameters

    imu = publisher(Imu, "imu/data", qos=SENSOR_DATA)

    @timer(hz="rate_hz")
    def publish_imu(self) -> None:
        noise = self.parameters.noise
        ax, ay, az, wx, wy, wz = (noise * (2.0 * self.rng.random(6) - 1.0)).tolist()
        self.imu.publish(
            Imu(
                header=Header(stamp=self.clock.now(), frame_id=self.parameters.frame_id),
                orientation=Quaternion(w=1.0),
                linear_acceleration=Vector3(x=ax, y=ay, z=GRAVITY + az),
                angular_velocity=Vector3(x=wx / 2, y=wy / 2, z=wz / 2),
            )
        )
