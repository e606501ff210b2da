"""The simulated sensors of lab 1: an IMU, ten joints and, on request, a camera."""

from math import sin

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, ReadOnly, Timer, publisher, service, take, timer
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.msgs.std_msgs import Header
from busflow.msgs.std_srvs import Trigger

GRAVITY = 9.8
"""The upward acceleration measured at rest, m/s²."""

SWINGS = {
    "hip": (0.2, 0.0),
    "knee": (0.1, 0.0),
    "ankle": (0.05, 0.5),
    "shoulder": (0.3, 1.0),
    "elbow": (0.2, 1.5),
}
"""A joint swings as amplitude · sin(t + phase): its amplitude and phase, in rad. Left and right swing alike."""

JOINT_NAMES = tuple(f"{side}_{joint}_joint" for joint in SWINGS for side in ("left", "right"))

AT_REST = take(np.zeros(len(JOINT_NAMES)))  # never changed, so all messages share it


class Noise(Parameters):
    imu: float = Field(default=0.1, ge=0, le=10, description="n: ±n m/s² along x and y, ±2n along z, ±n/2 rad/s.")
    joints: float = Field(default=0.0, ge=0, le=1, description="± this on each joint position, rad.")


class SensorPublisherParameters(Parameters):
    rate_hz: float = Field(default=10.0, ge=0, le=1000, description="How often the sensors publish; 0 is off.")
    noise: Noise = Field(default=Noise(), description="How far off the readings may be.")
    camera_hz: ReadOnly[float] = Field(
        default=0.0, ge=0, le=200, description="How often the camera publishes; 0 is no camera."
    )
    camera_width: ReadOnly[int] = Field(default=640, ge=1, le=7680, description="Width of a frame, pixels.")
    camera_height: ReadOnly[int] = Field(default=480, ge=1, le=4320, description="Height of a frame, pixels.")


class SensorPublisher(Node):
    """Publishes simulated IMU and joint readings and, on request, a camera's frames."""

    parameters: SensorPublisherParameters

    imu = publisher(Imu, "imu/data")
    joint_states = publisher(JointState, "joint_states")

    def declare(self) -> None:
        self.camera: Timer | None = None
        if self.parameters.camera_hz > 0:
            self.images = self.create_publisher(Image, "camera/image_raw", qos=SENSOR_DATA)
            self.camera = self.create_timer(1 / self.parameters.camera_hz, self.publish_image)

    async def start(self) -> None:
        self.scene = gradient(self.parameters.camera_width, self.parameters.camera_height)
        self.began_s = self.clock.seconds()

    @service(Trigger, "~/reset")
    def on_reset(self, _request: Trigger.Request) -> Trigger.Response:
        """Restart time, noise and the joints' swing, as at the start of the run."""
        lived_s = self.seconds()
        self.began_s = self.clock.seconds()
        self.rng.reseed()
        self.publish_sensors.reset()
        if self.camera is not None:
            self.camera.reset()
        self.log.info("the simulation begins anew", after_s=lived_s)
        return Trigger.Response(success=True, message=f"began anew after {lived_s:g} s")

    def seconds(self) -> float:
        """The simulation's time, exact to the nanosecond, so that a reset repeats the same numbers exactly."""
        return round(self.clock.seconds() - self.began_s, 9)

    @timer(hz="rate_hz")
    def publish_sensors(self) -> None:
        self.imu.publish(self.read_imu())
        self.joint_states.publish(self.read_joints())

    def read_imu(self) -> Imu:
        """Publish the readings of a body at rest: gravity and noise."""
        n = self.parameters.noise.imu
        ax, ay, az, wx, wy, wz = self.noise([n, n, 2 * n, n / 2, n / 2, n / 2])
        return Imu(
            header=Header(stamp=self.clock.now(), frame_id="imu_link"),
            orientation=Quaternion(w=1.0),
            linear_acceleration=Vector3(x=ax, y=ay, z=GRAVITY + az),
            angular_velocity=Vector3(x=wx, y=wy, z=wz),
        )

    def read_joints(self) -> JointState:
        """Publish ten swinging joints, each pair with its own amplitude and phase."""
        t = self.seconds()
        noise = self.noise([self.parameters.noise.joints] * len(JOINT_NAMES))
        swings = [amplitude * sin(t + phase) for amplitude, phase in SWINGS.values() for _side in ("left", "right")]
        return JointState(
            header=Header(stamp=self.clock.now()),
            name=JOINT_NAMES,
            position=[swing + off for swing, off in zip(swings, noise, strict=True)],
            velocity=AT_REST,
            effort=AT_REST,
        )

    def publish_image(self) -> None:
        """Publish a gradient with a bright bar that crosses it once per second."""
        width, height = self.parameters.camera_width, self.parameters.camera_height
        frame = self.scene.copy()
        frame[:, int(self.seconds() * width) % width] = 255
        image = Image(
            header=Header(stamp=self.clock.now(), frame_id="camera_link"),
            height=height,
            width=width,
            encoding="rgb8",
            step=3 * width,
            data=take(frame.reshape(-1)),  # this frame is not changed again, so the message need not copy it
        )
        self.images.publish(image)

    def noise(self, limits: list[float]) -> list[float]:
        """Return a random number within ± each limit; numpy is faster with all of them at once."""
        if not any(limits):
            return limits
        drawn = self.rng.random(len(limits)).tolist()
        return [limit * (2.0 * number - 1.0) for limit, number in zip(limits, drawn, strict=True)]


def gradient(width: int, height: int) -> NDArray[np.uint8]:
    """Return a frame whose red grows to the right and green downwards, which shows its orientation."""
    picture = np.zeros((height, width, 3), np.uint8)
    picture[:, :, 0] = np.linspace(0, 255, width)
    picture[:, :, 1] = np.linspace(0, 255, height)[:, np.newaxis]
    return picture
