"""The joint mover of the lab: moves one joint to an angle over time, as an action with feedback and a cancel."""

import asyncio

from pydantic import Field

from busflow import (
    ActionType,
    Duration,
    Message,
    Node,
    Parameters,
    QoS,
    ReadOnly,
    RunningGoal,
    action,
    publisher,
    subscription,
)
from busflow.msgs.sensor_msgs import JointState
from busflow.msgs.std_msgs import Header
from busflow.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint


class MoveJoint(ActionType, package="lab"):
    """Moves a joint to an angle."""

    class Goal(Message):
        """Which joint, where to, and how fast."""

        joint: str = ""
        angle: float = 0.0
        """rad"""
        speed: float = 0.5
        """rad/s"""

    class Result(Message):
        """Where the joint stopped."""

        angle: float = 0.0
        """rad"""

    class Feedback(Message):
        """Where the joint is, and how much of the way is left."""

        angle: float = 0.0
        """rad"""
        left: float = 0.0
        """rad"""


class JointMoverParameters(Parameters):
    step_s: float = Field(default=0.05, ge=0.001, le=1, description="The time from one command to the next, s.")
    max_angle: float = Field(default=1.5, gt=0, le=3.2, description="No joint turns further to either side, rad.")
    max_speed: float = Field(default=2.0, gt=0, le=20, description="No joint turns faster, rad/s.")
    joints: ReadOnly[list[str]] = Field(
        default=["left_elbow_joint", "right_elbow_joint"], min_length=1, description="The names of the joints."
    )


class JointMover(Node):
    """Moves joints to angles, one at a time; a newer goal replaces the one before."""

    parameters: JointMoverParameters

    commands = publisher(JointTrajectory, "joint_commands", qos=QoS(depth=1))

    async def start(self) -> None:
        self.angles = dict.fromkeys(self.parameters.joints, 0.0)

    @subscription("joint_states")
    def on_joints(self, joints: JointState) -> None:
        for name, angle in zip(joints.name, joints.position, strict=False):
            if name in self.angles:
                self.angles[name] = float(angle)

    @action(MoveJoint, "~/move", when_busy="replace")
    async def move(self, goal: RunningGoal[MoveJoint]) -> MoveJoint.Result:
        joint, target = goal.request.joint, goal.request.angle
        angle = self.angles[joint]
        try:
            while angle != target:
                await self.clock.sleep(self.parameters.step_s)
                step = goal.request.speed * self.parameters.step_s
                angle += max(-step, min(step, target - angle))
                self.command(joint, angle, self.parameters.step_s)
                goal.feedback(MoveJoint.Feedback(angle=angle, left=abs(target - angle)))
        except asyncio.CancelledError:  # also by a newer goal
            self.log.info("stopped", joint=joint, angle=round(angle, 3))
        finally:
            self.command(joint, angle, 0.0)  # hold the joint where it is
        return MoveJoint.Result(angle=angle)

    @move.accepts
    def possible(self, request: MoveJoint.Goal) -> bool | str:
        limits = self.parameters
        if request.joint not in limits.joints:
            return f"there is no joint {request.joint!r}, only {', '.join(limits.joints)}"
        if not abs(request.angle) <= limits.max_angle:
            return f"{request.angle:g} rad is beyond {limits.max_angle:g}"
        if not 0 < request.speed <= limits.max_speed:
            return f"{request.speed:g} rad/s is no speed from 0 to {limits.max_speed:g}"
        return True

    def command(self, joint: str, angle: float, within_s: float) -> None:
        point = JointTrajectoryPoint(positions=[angle], time_from_start=Duration(seconds=within_s))
        header = Header(stamp=self.clock.now())
        self.commands.publish(JointTrajectory(header=header, joint_names=[joint], points=[point]))
