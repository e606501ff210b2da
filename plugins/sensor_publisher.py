"""The simulated sensors of lab 1: an IMU, ten joints and, on request, a camera."""

from math import sin

import numpy as np
from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, publisher, timer
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.msgs.std_msgs import Header

GRAVITY = 9.8
"""What an accelerometer at rest measures upwards, m/s²."""

JOINTS = {
    "hip": (0.2, 0.0),
    "knee": (0.1, 0.0),
    "ankle": (0.05, 0.5),
    "shoulder": (0.3, 1.0),
    "elbow": (0.2, 1.5),
}
"""Each joint swings as amplitude · sin(t + phase), in rad; left and right alike."""

JOINT_NAMES = [f"{side}_{joint}_joint" for joint in JOINTS for side in ("left", "right")]


class Noise(Parameters):
    imu: float = Field(default=0.1, ge=0, le=10, description="Noise of the IMU, m/s²; see the node's page.")
    joints: float = Field(default=0.0, ge=0, le=1, description="Uniform noise on joint positions, ± rad.")


class SensorPublisherParameters(Parameters):
    rate_hz: float = Field(default=10.0, ge=0, le=1000, description="How often the sensors publish; 0 is off.")
    noise: Noise = Field(default=Noise(), description="How much the sensors err.")
    camera_hz: float = Field(default=0.0, ge=0, le=200, description="How often the camera publishes; 0 is no camera.")
    camera_width: int = Field(default=640, ge=1, le=7680, description="Width of a frame, pixels.")
    camera_height: int = Field(default=480, ge=1, le=4320, description="Height of a frame, pixels.")


class SensorPublisher(Node):
    """Publishes simulated IMU and joint readings, and a camera's frames where asked for."""

    parameters: SensorPublisherParameters

    imu = publisher(Imu, "imu/data")
    joint_states = publisher(JointState, "joint_states")

    def declare(self) -> None:
        if self.parameters.camera_hz > 0:
            self.images = self.create_publisher(Image, "camera/image_raw", qos=SENSOR_DATA)
            self.create_timer(1 / self.parameters.camera_hz, self.publish_image)

    async def start(self) -> None:
        self.started_s = self.clock.seconds()

    @timer(hz="rate_hz")
    def publish_sensors(self) -> None:
        self.imu.publish(self.read_imu())
        self.joint_states.publish(self.read_joints())

    def read_imu(self) -> Imu:
        """Gravity and a body at rest, both with noise."""
        n = self.parameters.noise.imu
        ax, ay, az, wx, wy, wz = self.rng.uniform(-1.0, 1.0, 6) * (n, n, 2 * n, n / 2, n / 2, n / 2)
        return Imu(
            header=self.stamped("imu_link"),
            orientation=Quaternion(w=1.0),
            linear_acceleration=Vector3(x=ax, y=ay, z=GRAVITY + az),
            angular_velocity=Vector3(x=wx, y=wy, z=wz),
        )

    def read_joints(self) -> JointState:
        """Ten joints that swing, each pair in its own way."""
        t = self.clock.seconds() - self.started_s
        swing = [amplitude * sin(t + phase) for amplitude, phase in JOINTS.values() for _side in range(2)]
        n = self.parameters.noise.joints
        return JointState(
            header=self.stamped(""),
            name=JOINT_NAMES,
            position=np.array(swing) + self.rng.uniform(-n, n, len(swing)),
            velocity=np.zeros(len(swing)),
            effort=np.zeros(len(swing)),
        )

    def publish_image(self) -> None:
        """A frame whose colours drift with time, so that a viewer shows it is live."""
        width, height = self.parameters.camera_width, self.parameters.camera_height
        frame = np.empty((height, width, 3), np.uint8)
        frame[..., 0] = np.linspace(0, 255, width)
        frame[..., 1] = np.linspace(0, 255, height)[:, None]
        frame[..., 2] = int(self.clock.seconds() * 64) % 256
        image = Image(
            header=self.stamped("camera_link"),
            height=height,
            width=width,
            encoding="rgb8",
            step=width * 3,
            data=frame.ravel(),
        )
        self.images.publish(image)

    def stamped(self, frame_id: str) -> Header:
        return Header(stamp=self.clock.now(), frame_id=frame_id)
