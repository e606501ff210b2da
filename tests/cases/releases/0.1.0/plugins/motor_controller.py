"""The motor controller of the lab: keeps the robot upright with its ankles and hips, by a PD law on the balance."""

from math import isfinite

from pydantic import Field, model_validator

from busflow import DeadlineMissed, Duration, Node, Parameters, QoS, ReadOnly, on_event, publisher, subscription
from busflow.msgs.std_msgs import Float64, Header
from busflow.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint

NEWEST = QoS(depth=1)
"""Reliable, keeps only the newest: an older balance or command is useless."""


class Drive(Parameters):
    """The gains and limits of a pair of joints."""

    p: float = Field(default=0.4, ge=0, le=10, description="Angle per balance, rad.")
    d: float = Field(default=0.02, ge=0, le=10, description="Angle per change of the balance, rad per 1/s.")
    max_angle: float = Field(default=0.35, ge=0, le=1.5, description="They turn no further to either side, rad.")
    max_speed: float = Field(default=2.0, ge=0, le=20, description="They turn no faster, rad/s.")


class MotorControllerParameters(Parameters):
    target: float = Field(default=0.0, ge=0, le=1, description="The balance to hold; 0 is steady.")
    reach_s: float = Field(default=0.1, ge=0.001, le=10, description="In how long the joints are where told, s.")
    ankle: Drive = Field(default=Drive(), description="How the ankles answer.")
    hip: Drive = Field(default=Drive(), description="How the hips answer.")
    ankle_joints: ReadOnly[list[str]] = Field(
        default=["left_ankle_joint", "right_ankle_joint"], description="The names of the ankles."
    )
    hip_joints: ReadOnly[list[str]] = Field(
        default=["left_hip_joint", "right_hip_joint"], description="The names of the hips."
    )

    @model_validator(mode="after")
    def each_joint_has_one_drive(self) -> "MotorControllerParameters":
        joints = [*self.ankle_joints, *self.hip_joints]
        twice = sorted({joint for joint in joints if joints.count(joint) > 1})
        if twice:
            raise ValueError(f"a joint cannot follow two commands: {', '.join(twice)}")
        return self


class MotorController(Node):
    """Turns the balance into commands for the motors of ankles and hips."""

    parameters: MotorControllerParameters

    commands = publisher(JointTrajectory, "motor_commands", qos=NEWEST)

    async def start(self) -> None:
        self.last: tuple[float, float] | None = None  # time and value of the last balance
        self.ankle_angle = self.hip_angle = 0.0  # the last commands

    @subscription("balance_state", qos=NEWEST)
    def on_balance(self, balance: Float64) -> None:
        if not isfinite(balance.data):
            self.log.warning("not a balance: the joints stay where they are", balance=balance.data)
            return
        parameters, now_s = self.parameters, self.clock.seconds()
        then_s, before = self.last or (now_s, balance.data)
        self.last = now_s, balance.data
        elapsed_s = now_s - then_s
        change = (balance.data - before) / elapsed_s if elapsed_s > 0 else 0.0
        error = balance.data - parameters.target
        turn_s = min(elapsed_s, parameters.reach_s)  # a long silence is not followed by a leap
        self.ankle_angle = turned(parameters.ankle, error, change, self.ankle_angle, turn_s)
        self.hip_angle = turned(parameters.hip, error, change, self.hip_angle, turn_s)
        self.command()

    def command(self) -> None:
        ankles, hips = self.parameters.ankle_joints, self.parameters.hip_joints
        point = JointTrajectoryPoint(
            positions=[self.ankle_angle] * len(ankles) + [self.hip_angle] * len(hips),
            time_from_start=Duration(seconds=self.parameters.reach_s),
        )
        header = Header(stamp=self.clock.now())
        self.commands.publish(JointTrajectory(header=header, joint_names=[*ankles, *hips], points=[point]))

    @on_event("balance_state")
    def on_silence(self, _event: DeadlineMissed) -> None:
        """No balance within its deadline: a trajectory without points tells the motors to hold still."""
        if self.last is not None:
            self.last = None
            self.log.warning("the balance is silent: the joints stay where they are")
            self.commands.publish(JointTrajectory(header=Header(stamp=self.clock.now())))


def turned(drive: Drive, error: float, change: float, before: float, seconds: float) -> float:
    """Return the next angle of a drive: P and D of the error, within its limits of angle and speed."""
    wanted = limited(drive.p * error + drive.d * change, drive.max_angle)
    return before + limited(wanted - before, drive.max_speed * seconds)


def limited(value: float, limit: float) -> float:
    """Clamp a value to ± the limit."""
    return max(-limit, min(limit, value))
