"""The lab's robot as a body that obeys physics: it stands, is pushed, and falls where nothing balances it."""

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, field_validator

from busflow import (
    SENSOR_DATA,
    Message,
    Node,
    Parameters,
    ReadOnly,
    ServiceType,
    on_parameters,
    publisher,
    service,
    subscription,
    timer,
)
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.geometry_msgs import Point, Pose, PoseStamped, Quaternion, Vector3, Wrench, WrenchStamped
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Header
from busflow.msgs.std_srvs import Trigger
from busflow.msgs.trajectory_msgs import JointTrajectory

from .humanoid_body import Body, read_model
from .motor_controller import NEWEST
from .sensor_publisher import Noise

PROJECT = Path(__file__).parents[1]
"""The folder that holds `plugins` and `configs`."""

MOST_N = 1000.0
"""The hardest push that can be asked for, N."""


class Push(ServiceType, package="lab"):
    """Pushes the robot at its pelvis."""

    class Request(Message):
        """How hard, and for how long."""

        force: Annotated[float, Field(ge=-MOST_N, le=MOST_N)] = 0.0
        """N; forwards, or backwards if negative."""
        duration: Annotated[float, Field(gt=0, le=10)] = 0.1
        """s; the push ends with one of the simulator's periods."""

    class Response(Message):
        """What was done."""

        success: bool = False
        message: str = ""


class HumanoidSimulatorParameters(Parameters):
    rate_hz: float = Field(default=50.0, ge=0, le=1000, description="How often the sensors publish; 0 is a pause.")
    model: ReadOnly[str] = Field(
        default="configs/humanoid/lab.xml",
        validate_default=True,
        description="The body's MJCF file; a relative path begins at the folder that holds plugins/.",
    )
    mass: float = Field(default=64.0, ge=20, le=200, description="The mass of the whole body, kg.")
    friction: float = Field(default=1.0, ge=0.01, le=2, description="The friction of the floor.")
    noise: Noise = Field(default=Noise(), description="How far off the readings may be.")
    push_force: list[Annotated[float, Field(ge=0, le=MOST_N)]] = Field(
        default=[0.0, 0.0], min_length=2, max_length=2, description="Least and greatest random push, N; 0 is none."
    )
    push_every_s: list[Annotated[float, Field(ge=0.1)]] = Field(
        default=[5.0, 15.0], min_length=2, max_length=2, description="Least and greatest time between two pushes, s."
    )
    push_s: float = Field(default=0.1, gt=0, le=10, description="How long a random push lasts, s.")

    @field_validator("model")
    @classmethod
    def is_a_model(cls, model: str) -> str:
        read_model(PROJECT / model)
        return model

    @field_validator("push_force", "push_every_s")
    @classmethod
    def the_least_comes_first(cls, limits: list[float]) -> list[float]:
        if limits[0] > limits[-1]:
            raise ValueError(f"the least must come first, got {limits[0]:g} before {limits[-1]:g}")
        return limits


class HumanoidSimulator(Node):
    """Steps a humanoid's physics, publishes what its sensors feel, and takes commands for its motors."""

    parameters: HumanoidSimulatorParameters

    imu = publisher(Imu, "imu/data")
    joint_states = publisher(JointState, "joint_states")
    left_foot = publisher(WrenchStamped, "left/foot/wrench", qos=SENSOR_DATA)
    right_foot = publisher(WrenchStamped, "right/foot/wrench", qos=SENSOR_DATA)
    pelvis = publisher(PoseStamped, "pelvis/pose")

    async def start(self) -> None:
        self.body = Body(PROJECT / self.parameters.model)
        self.stand()

    def stand(self) -> None:
        """Begin as at the start of the run: upright, with the same noise and the same pushes to come."""
        self.body.reset()
        self.body.adjust(self.parameters.mass, self.parameters.friction)
        self.chance = np.random.default_rng(self.rng.integers(2**63))  # pushes do not depend on how much noise is drawn
        self.next_push_s = self.drawn(self.parameters.push_every_s)
        self.is_down = False

    @on_parameters
    def on_change(self, _before: HumanoidSimulatorParameters) -> None:
        self.body.adjust(self.parameters.mass, self.parameters.friction)

    @service(Trigger, "~/reset")
    def on_reset(self, _request: Trigger.Request) -> Trigger.Response:
        """Stand up, and restart time, noise and pushes, as at the start of the run."""
        lived_s = self.body.seconds
        self.rng.reseed()
        self.stand()
        self.step.reset()
        self.log.info("the robot stands anew", after_s=lived_s)
        return Trigger.Response(success=True, message=f"stands anew after {lived_s:g} s")

    @service(Push, "~/push")
    def on_push(self, request: Push.Request) -> Push.Response:
        self.body.push(request.force, request.duration)
        return Push.Response(success=True, message=f"{request.force:g} N for {request.duration:g} s")

    @subscription("motor_commands", qos=NEWEST)
    def on_command(self, command: JointTrajectory) -> None:
        if not command.points:
            self.body.hold()
            return
        if len(command.points) > 1:
            self.log.warning("only the first point of a trajectory is followed", points=len(command.points))
        point = command.points[0]
        within = point.time_from_start
        self.body.turn(command.joint_names, point.positions.tolist(), within.sec + within.nanosec / 1e9)

    @timer(hz="rate_hz")
    def step(self) -> None:
        if self.body.seconds >= self.next_push_s:
            self.push_at_random()
        try:
            self.body.step(1.0 / self.parameters.rate_hz)
        except FloatingPointError as error:
            text = f"the physics became unstable {self.body.seconds:g} s after the robot stood: {error}"
            raise FloatingPointError(f"{text}; give the model softer motors or a smaller timestep") from error
        if self.body.has_fallen != self.is_down:
            self.is_down = self.body.has_fallen
            if self.is_down:
                self.log.warning("the robot has fallen", stood_s=self.body.seconds)
        self.publish_readings()

    def push_at_random(self) -> None:
        force = self.drawn(self.parameters.push_force) * (1 if self.chance.random() < 0.5 else -1)
        self.next_push_s += self.drawn(self.parameters.push_every_s)
        if force:
            self.body.push(force, self.parameters.push_s)

    def drawn(self, limits: list[float]) -> float:
        least, greatest = limits
        return self.chance.uniform(least, greatest)

    def publish_readings(self) -> None:
        body, stamp = self.body, self.clock.now().to_msg()
        x, y, z, qw, qx, qy, qz = body.place
        orientation = Quaternion(x=qx, y=qy, z=qz, w=qw)
        self.imu.publish(self.read_imu(stamp, orientation))
        self.joint_states.publish(self.read_joints(stamp))
        self.left_foot.publish(self.read_foot("left", stamp))
        self.right_foot.publish(self.read_foot("right", stamp))
        pose = Pose(position=Point(x=x, y=y, z=z), orientation=orientation)
        self.pelvis.publish(PoseStamped(header=Header(stamp=stamp, frame_id="world"), pose=pose))

    def read_imu(self, stamp: Time, orientation: Quaternion) -> Imu:
        noise = self.parameters.noise.imu * (2.0 * self.rng.random(6) - 1.0)  # numpy is faster with all of them at once
        nx, ny, nz, mx, my, mz = noise.tolist()
        ax, ay, az = self.body.felt("acceleration")
        wx, wy, wz = self.body.felt("rotation")
        return Imu(
            header=Header(stamp=stamp, frame_id="imu_link"),
            orientation=orientation,
            linear_acceleration=Vector3(x=ax + nx, y=ay + ny, z=az + 2 * nz),
            angular_velocity=Vector3(x=wx + mx / 2, y=wy + my / 2, z=wz + mz / 2),
        )

    def read_joints(self, stamp: Time) -> JointState:
        body, noise = self.body, self.parameters.noise.joints
        position = body.positions
        if noise:
            position += noise * (2.0 * self.rng.random(len(position)) - 1.0)
        header = Header(stamp=stamp)
        return JointState(
            header=header, name=body.joints, position=position, velocity=body.velocities, effort=body.efforts
        )

    def read_foot(self, side: str, stamp: Time) -> WrenchStamped:
        """Return how the ground presses on a foot, as its ankle feels it: the weight on it is a force upwards."""
        fx, fy, fz = self.body.felt(f"{side}_force")
        tx, ty, tz = self.body.felt(f"{side}_torque")
        wrench = Wrench(force=Vector3(x=-fx, y=-fy, z=-fz), torque=Vector3(x=-tx, y=-ty, z=-tz))
        return WrenchStamped(header=Header(stamp=stamp, frame_id=f"{side}_foot_link"), wrench=wrench)
