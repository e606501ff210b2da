"""The node that publishes a robot's description and where its links are."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from busflow import TRANSIENT_LOCAL, Node, Time, transforms
from busflow.description.robot_state_publisher import RobotStatePublisher
from busflow.msgs.sensor_msgs import JointState
from busflow.msgs.std_msgs import Header, String
from busflow.msgs.tf2_msgs import TFMessage
from busflow.testing import Harness, harness, virtual_time
from tests.golden import Golden

URDF = """\
<robot name="arm">
  <link name="base"/><link name="upper"/><link name="lower"/><link name="tool"/><link name="camera"/><link name="cart"/>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="upper"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/><limit lower="-2" upper="2"/>
  </joint>
  <joint name="elbow" type="continuous">
    <parent link="upper"/><child link="lower"/><origin xyz="1 0 0"/><axis xyz="0 0 1"/>
    <mimic joint="shoulder" multiplier="-1"/>
  </joint>
  <joint name="lift" type="prismatic">
    <parent link="lower"/><child link="tool"/><axis xyz="0 0 1"/><limit lower="0" upper="1"/>
  </joint>
  <joint name="mount" type="fixed"><parent link="base"/><child link="camera"/><origin xyz="0.1 0 0"/></joint>
  <joint name="free" type="floating"><parent link="base"/><child link="cart"/></joint>
</robot>
"""
LAUNCH = """\
nodes:
  robot_state_publisher:
    plugin: robot_state_publisher
    parameters: {description: robots/arm.urdf}
    restart: on-failure
topics:
  joint_states: {external: true}
"""


class User(Node):
    frames = transforms()


@pytest.fixture
def file(tmp_path: Path) -> Path:
    (tmp_path / "robots").mkdir()
    (tmp_path / "robots/arm.urdf").write_text(URDF)
    (tmp_path / "lab.yaml").write_text(LAUNCH)
    return tmp_path / "lab.yaml"


def joints(stamp: Time | None = None, **positions: float) -> JointState:
    header = Header(stamp=stamp.to_msg()) if stamp is not None else Header()
    return JointState(header=header, name=list(positions), position=list(positions.values()))


def edges(lab: Harness, topic: str = "/tf") -> list[tuple[str, str]]:
    return [
        (each.header.frame_id, each.child_frame_id)
        for found in lab.received(topic, TFMessage)
        for each in found.transforms
    ]


def write(file: Path, urdf: str) -> None:
    (file.parent / "robots/arm.urdf").write_text(urdf)


def warnings(lab: Harness) -> list[str]:
    return [each.event for each in lab.log if each.level == "warning"]


@virtual_time
async def test_links_move_as_joint_states_say(file: Path):
    async with harness(file, User) as lab:
        stamp = Time(seconds=7)
        lab.publish("joint_states", joints(stamp, shoulder=math.pi / 2, lift=0.25))
        await lab.settle()
        tool = lab.node(User).frames.latest("base", "tool")
        assert edges(lab) == [("base", "upper"), ("upper", "lower"), ("lower", "tool")]
    at, turn = tool.transform.translation, tool.transform.rotation
    assert (at.x, at.y, at.z) == pytest.approx((0, 1, 1.25))
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx((0, 0, 0, 1))  # the elbow turns back what the shoulder did
    assert tool.header.stamp == stamp.to_msg()


@virtual_time
async def test_latecomer_gets_description_and_fixed_links(file: Path):
    async with harness(file) as lab:
        await lab.advance(5)
        description = lab.subscribe(String, "robot_description", qos=TRANSIENT_LOCAL)
        fixed = lab.subscribe(TFMessage, "/tf_static", qos=TRANSIENT_LOCAL)
        await lab.settle()
        assert description.latest is not None
        assert description.latest.data == URDF
        assert fixed.latest is not None
        (mount,) = fixed.latest.transforms
    assert (mount.header.frame_id, mount.child_frame_id, mount.transform.translation.x) == ("base", "camera", 0.1)


@virtual_time
async def test_only_joints_with_a_position_are_published(file: Path):
    async with harness(file) as lab:
        lab.publish("joint_states", joints(Time(seconds=1), lift=0.5, mount=3.0, elbow=1.0))
        lab.publish("joint_states", JointState(name=["shoulder"], velocity=[1.0]))
        await lab.settle()
        assert edges(lab) == [("lower", "tool")]  # elbow follows the shoulder, which nothing is known of
        assert warnings(lab) == []


@virtual_time
async def test_state_without_stamp_gets_the_time(file: Path):
    async with harness(file) as lab:
        await lab.advance(2)
        lab.publish("joint_states", joints(lift=0.5))
        await lab.settle()
        (message,) = lab.received("/tf", TFMessage)
        assert message.transforms[0].header.stamp == lab.graph.clock.now().to_msg()


@virtual_time
async def test_wrong_states_are_warned_of_once(file: Path, golden: Golden):
    async with harness(file, User) as lab:
        for _ in range(3):
            lab.publish("joint_states", joints(Time(seconds=1), sholder=1.0, lift=math.nan))
            lab.publish("joint_states", JointState(name=["lift", "shoulder"], position=[1.0]))
            lab.publish("joint_states", joints(Time(seconds=1), lift=math.inf))
        await lab.settle()
        assert edges(lab) == []
        golden("\n".join(warnings(lab)))


@pytest.fixture
def two_robots(file: Path) -> Path:
    left, right = (
        f"  {side}/robot_state_publisher:\n    plugin: robot_state_publisher\n"
        f"    parameters: {{description: robots/arm.urdf, frame_prefix: {side}_}}\n"
        for side in ("left", "right")
    )
    file.write_text(f"nodes:\n{left}{right}")
    return file


@virtual_time
async def test_prefix_keeps_two_robots_apart(two_robots: Path):
    async with harness(two_robots) as lab:
        lab.publish("left/joint_states", joints(Time(seconds=1), lift=0.5))
        await lab.settle()
        assert edges(lab) == [("left_lower", "left_tool")]
        assert edges(lab, "/tf_static") == [("left_base", "left_camera"), ("right_base", "right_camera")]


@virtual_time
async def test_time_set_back_empties_and_goes_on(file: Path):
    """A bag that plays again: what moves is forgotten, what is fixed is not, and the next states are known."""
    async with harness(file, User) as lab:
        for seconds in (10, 11, 1):
            lab.publish("joint_states", joints(Time(seconds=seconds), shoulder=0.1, lift=0.2))
            await lab.settle()
        frames = lab.node(User).frames
        assert frames.latest("base", "tool").header.stamp == Time(seconds=1).to_msg()
        assert frames.latest("base", "camera").transform.translation.x == 0.1
        (line,) = warnings(lab)
        assert "/tf" in line


@virtual_time
async def test_description_is_read_again_for_a_restart(file: Path):
    async with harness(file) as lab:
        write(file, URDF.replace('name="arm"', 'name="longer_arm"'))
        lab.fail("robot_state_publisher", RuntimeError("it is made to fail"))
        lab.publish("joint_states", joints(lift=0.5))
        await lab.advance(5)
        assert lab.received("robot_description", String)[-1].data.startswith('<robot name="longer_arm">')


@virtual_time
async def test_restart_waits_for_a_whole_description(file: Path):
    async with harness(file) as lab:
        write(file, "<robot/>")
        lab.fail("robot_state_publisher", RuntimeError("it is made to fail"))
        lab.publish("joint_states", joints(lift=0.5))
        await lab.advance(0.5)
        assert f"{file.parent / 'robots/arm.urdf'}:1:2: error: " in lab.log[-2].event
        assert len(lab.received("robot_description", String)) == 1
        write(file, URDF)
        await lab.advance(1)
        assert len(lab.received("robot_description", String)) == 2


@virtual_time
async def test_class_reads_from_the_working_directory(file: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(file.parent)
    async with harness(RobotStatePublisher(description="robots/arm.urdf")) as lab:
        assert lab.node(RobotStatePublisher).robot.name == "arm"
