"""The controller that keeps the lab's humanoid upright: a PD law on its signed pitch, for ankles and hips."""

from math import isfinite

from pydantic import Field, model_validator

from busflow import SENSOR_DATA, DeadlineMissed, Node, Parameters, ReadOnly, on_event, publisher, subscription
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_msgs import Float64, Header
from busflow.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint

from .motor_controller import NEWEST, limited


class Gains(Parameters):
    """How a pair of joints answers to a lean; with a positive angle they push the robot back from falling forwards."""

    p: float = Field(ge=0, le=10, description="Angle per lean, rad per rad.")
    d: float = Field(ge=0, le=10, description="Angle per speed of the lean, rad per rad/s.")
    max_angle: float = Field(default=0.6, ge=0, le=1.5, description="They turn no further to either side, rad.")


class BalanceControllerParameters(Parameters):
    target: float = Field(default=0.03, ge=-0.2, le=0.2, description="The pitch to hold; ahead is positive, rad.")
    ankle: Gains = Field(default=Gains(p=1.4, d=0.5), description="How the ankles answer.")
    hip: Gains = Field(default=Gains(p=0.6, d=0.2), description="How the hips answer.")
    ankle_joints: ReadOnly[list[str]] = Field(
        default=["left_ankle_joint", "right_ankle_joint"], description="The names of the ankles."
    )
    hip_joints: ReadOnly[list[str]] = Field(
        default=["left_hip_joint", "right_hip_joint"], description="The names of the hips."
    )

    @model_validator(mode="after")
    def each_joint_has_one_command(self) -> "BalanceControllerParameters":
        if twice := sorted(set(self.ankle_joints) & set(self.hip_joints)):
            raise ValueError(f"a joint cannot follow two commands: {', '.join(twice)}")
        return self


class BalanceController(Node):
    """Turns the pitch into commands for the motors of ankles and hips."""

    parameters: BalanceControllerParameters

    commands = publisher(JointTrajectory, "motor_commands", qos=NEWEST)

    async def start(self) -> None:
        self.speed = 0.0  # of the lean, rad/s
        self.is_silent = True

    @subscription("imu/data", qos=SENSOR_DATA)
    def on_imu(self, imu: Imu) -> None:
        self.speed = imu.angular_velocity.y  # of the gyroscope: it needs no difference of two pitches, and no clock

    @subscription("pitch", qos=NEWEST)
    def on_pitch(self, pitch: Float64) -> None:
        self.is_silent = False
        lean = pitch.data - self.parameters.target
        if not isfinite(lean) or not isfinite(self.speed):
            self.log.warning("not a pitch: the joints stay where they are", pitch=pitch.data, speed=self.speed)
            return
        ankle, hip = (self.answer(gains, lean) for gains in (self.parameters.ankle, self.parameters.hip))
        ankles, hips = self.parameters.ankle_joints, self.parameters.hip_joints
        point = JointTrajectoryPoint(positions=[ankle] * len(ankles) + [hip] * len(hips))
        header = Header(stamp=self.clock.now())
        self.commands.publish(JointTrajectory(header=header, joint_names=[*ankles, *hips], points=[point]))

    def answer(self, gains: Gains, lean: float) -> float:
        return limited(gains.p * lean + gains.d * self.speed, gains.max_angle)

    @on_event("pitch")
    def on_silence(self, _event: DeadlineMissed) -> None:
        """Hold the joints still where no pitch came in time: by a trajectory without points."""
        if not self.is_silent:
            self.is_silent = True
            self.log.warning("the pitch is silent: the joints stay where they are")
            self.commands.publish(JointTrajectory(header=Header(stamp=self.clock.now())))
