"""RobotStatePublisher: the node that publishes a robot's description, and where its links are as its joints move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite

from pydantic import Field

from busflow.bus.qos import TRANSIENT_LOCAL, QoS
from busflow.description.robot import MOVES, Joint, JointKind, Robot
from busflow.description.urdf import read_robot
from busflow.errors import LaunchError, Place, Problem
from busflow.frames.rigid import Rigid
from busflow.msgs.builtin_interfaces import Time as TimeMsg
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from busflow.msgs.sensor_msgs import JointState
from busflow.msgs.std_msgs import Header, String
from busflow.msgs.tf2_msgs import TFMessage
from busflow.node.declarations import publisher
from busflow.node.handlers import subscription
from busflow.node.node import Node, runtime_of
from busflow.node.parameters import Parameters, ReadOnly
from busflow.text import did_you_mean, quoted

_MOST_WARNINGS = 100
"""The most joints of which a run warns."""


class RobotStatePublisherParameters(Parameters):
    """Parameters of RobotStatePublisher."""

    description: ReadOnly[str] = Field(min_length=1, description="The robot's URDF file, relative to the launch file.")
    frame_prefix: ReadOnly[str] = Field(default="", description="Put before the name of each frame: left_.")


class RobotStatePublisher(Node):
    """Publishes a robot's description, and where its links are as its joints move."""

    parameters: RobotStatePublisherParameters
    _description = publisher(String, "robot_description", qos=TRANSIENT_LOCAL)
    _fixed = publisher(TFMessage, "/tf_static", qos=TRANSIENT_LOCAL)
    _moving = publisher(TFMessage, "/tf", qos=QoS(depth=100))

    def declare(self) -> None:
        """Read the description here, so that its mistakes are found before anything starts.

        Raises:
            LaunchError: With every mistake.
        """
        around = runtime_of(self).surroundings
        stated = around.parameter_source("description")
        place = stated.place if stated is not None else None
        try:
            self.robot: Robot = read_robot(around.folder / self.parameters.description, around.packages)
        except LaunchError as error:
            raise LaunchError([_stated_at(place, each) for each in error.problems]) from None

    async def start(self) -> None:
        """Publish the description and what never moves, once: both topics keep it for whatever comes later."""
        self._names: Sequence[str] = ()
        self._plan: list[tuple[int, Joint]] = []
        self._warned: set[str] = set()
        self._moved_by: dict[str, list[Joint]] = {}
        for joint in self.robot.joints:
            if joint.kind in MOVES:
                self._moved_by.setdefault(joint.source, []).append(joint)
        stamp = self.clock.now().to_msg()
        fixed = [each for each in self.robot.joints if each.kind is JointKind.FIXED]
        self._description.publish(String(data=self.robot.text))
        self._fixed.publish(TFMessage(transforms=[self._transform(each, each.origin, stamp) for each in fixed]))

    @subscription("joint_states")
    def on_joints(self, joints: JointState) -> None:
        """Publish the transforms of the joints whose position the message has, and of those that mimic them."""
        names, positions, stamp = joints.name, joints.position.tolist(), joints.header.stamp
        if len(positions) != len(names):
            if positions:
                self._warn("", f"{len(names)} names and {len(positions)} positions on joint_states: they are left out")
            return
        if names != self._names:
            self._names, self._plan = names, self._planned(names)
        if not (stamp.sec or stamp.nanosec):
            stamp = self.clock.now().to_msg()
        transforms: list[TransformStamped] = []
        for index, joint in self._plan:
            position = positions[index]
            if isfinite(position):
                transforms.append(self._transform(joint, joint.motion(position), stamp))
            else:
                self._warn(joint.source, f"the position of the joint {quoted(joint.source)} is {position}: left out")
        if transforms:
            self._moving.publish(TFMessage(transforms=transforms))

    def _planned(self, names: Sequence[str]) -> list[tuple[int, Joint]]:
        """Return the joints that positions of these names move, each with the index of its position."""
        known = {each.name for each in self.robot.joints}
        for name in names:
            if name not in known:
                advice = did_you_mean(name, known, none="the robot has none")
                self._warn(name, f"joint_states has a joint {quoted(name)} that the robot has not; {advice}")
        return [(index, joint) for index, name in enumerate(names) for joint in self._moved_by.get(name, ())]

    def _transform(self, joint: Joint, motion: Rigid, stamp: TimeMsg) -> TransformStamped:
        x, y, z, qx, qy, qz, qw = motion
        prefix = self.parameters.frame_prefix
        return TransformStamped(
            header=Header(stamp=stamp, frame_id=prefix + joint.parent),
            child_frame_id=prefix + joint.child,
            transform=Transform(translation=Vector3(x=x, y=y, z=z), rotation=Quaternion(x=qx, y=qy, z=qz, w=qw)),
        )

    def _warn(self, joint: str, text: str) -> None:
        """Log a warning, once for each joint."""
        if joint not in self._warned and len(self._warned) < _MOST_WARNINGS:
            self._warned.add(joint)
            self.log.warning(text)


def _stated_at(place: Place | None, problem: Problem) -> Problem:
    """Return a problem of a file with the place that names the file."""
    if place is None:
        return problem
    return replace(problem, place=place) if problem.place is None else replace(problem, included_from=(place,))
