"""RobotStatePublisher: the node that publishes a robot's description, and where its links are as its joints move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite

from pydantic import Field

from busflow.bus.qos import TRANSIENT_LOCAL, QoS
from busflow.description.link_frame import LinkFrame
from busflow.description.robot import MOVES, JointKind, Robot
from busflow.description.urdf import read_robot
from busflow.errors import LaunchError, Place, Problem
from busflow.msgs.geometry_msgs import TransformStamped
from busflow.msgs.sensor_msgs import JointState
from busflow.msgs.std_msgs import String
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
        runtime_of(self).doubts += [_stated_at(place, each) for each in self.robot.doubts]

    async def start(self) -> None:
        """Publish the description and what never moves, once: both topics keep it for whatever comes later."""
        self._names: Sequence[str] = ()
        self._plan: list[tuple[int, LinkFrame]] = []
        self._warned: set[str] = set()
        self._moved_by: dict[str, list[LinkFrame]] = {}
        frames = [LinkFrame(each, self.parameters.frame_prefix) for each in self.robot.joints]
        for frame in frames:
            if frame.joint.kind in MOVES:
                self._moved_by.setdefault(frame.joint.source, []).append(frame)
        stamp = self.clock.now().to_msg()
        fixed = [each.at_rest(stamp) for each in frames if each.joint.kind is JointKind.FIXED]
        self._description.publish(String(data=self.robot.text))
        self._fixed.publish(TFMessage(transforms=fixed))

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
        for index, frame in self._plan:
            position = positions[index]
            if isfinite(position):
                transforms.append(frame.at(position, stamp))
            else:
                source = frame.joint.source
                self._warn(source, f"the position of the joint {quoted(source)} is {position}: left out")
        if transforms:
            self._moving.publish(TFMessage(transforms=transforms))

    def _planned(self, names: Sequence[str]) -> list[tuple[int, LinkFrame]]:
        """Return the frames that positions of these names move, each with the index of its position."""
        known = {each.name for each in self.robot.joints}
        for name in names:
            if name not in known:
                advice = did_you_mean(name, known, none="the robot has none")
                self._warn(name, f"joint_states has a joint {quoted(name)} that the robot has not; {advice}")
        return [(index, frame) for index, name in enumerate(names) for frame in self._moved_by.get(name, ())]

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
