"""The humanoid: its joints, its sensors, both its sides, and that one node's failure stops no other."""

import random
from collections import Counter
from math import pi, sin, tau
from pathlib import Path

import numpy as np
import pytest
import yaml

from busflow.errors import InvalidParameter
from busflow.msgs.geometry_msgs import WrenchStamped
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.testing import harness, virtual_time
from plugins.camera import Camera
from plugins.foot_sensor import FootSensor
from plugins.imu_sensor import ImuSensor
from plugins.joint_simulator import JointSimulator
from plugins.joint_state_publisher import JointStatePublisher
from plugins.sensor_processor import SensorProcessor

FOLDER = Path(__file__).parents[2] / "configs"
CONFIG = FOLDER / "humanoid.yaml"
SHARED = {"lower": -1.0, "upper": 1.0}
HIP = {"name": "hip", "amplitude": 0.3, "phase": 0.5, **SHARED}
KNEE = {"name": "knee", "amplitude": 0.2, "centre": 0.4, **SHARED}


def stated(name):
    return yaml.safe_load((FOLDER / f"humanoid/{name}.yaml").read_text("utf-8"))["joints"]


@virtual_time
async def received(node, topic, message_type, seconds, **options):
    async with harness(node(), **options) as lab:
        await lab.advance(seconds)
    return lab.received(topic, message_type)


# The whole robot.


@virtual_time
async def test_robot_publishes_31_joints_at_100_hz():
    limits = {f"{side}_{joint['name']}": joint for side in ("left", "right") for joint in stated("limb")}
    limits |= {joint["name"]: joint for joint in stated("trunk")}
    async with harness(CONFIG) as lab:
        await lab.advance(4)
        messages = lab.received("joint_states", JointState)
        assert 398 <= len(messages) <= 400
        assert {frozenset(each.name) for each in messages[1:]} == {frozenset(limits)}
        assert len(limits) == 31
        for each in messages:
            for name, angle in zip(each.name, each.position.tolist(), strict=True):
                assert limits[name]["lower"] <= angle <= limits[name]["upper"], name
        assert lab.ledger.dropped == 0


@virtual_time
async def test_robot_has_two_imus_two_feet_and_camera():
    async with harness(CONFIG) as lab:
        await lab.advance(2)
        imus = {place: lab.received(f"{place}/imu/data", Imu) for place in ("pelvis", "head")}
        assert {place: {each.header.frame_id for each in messages} for place, messages in imus.items()} == {
            "pelvis": {"pelvis_imu_link"},
            "head": {"head_imu_link"},
        }
        assert imus["pelvis"][0].linear_acceleration != imus["head"][0].linear_acceleration
        feet = [lab.received(f"{side}/foot/wrench", WrenchStamped) for side in ("left", "right")]
        assert [len(foot) for foot in feet] == [200, 200]
        for left, right in zip(*feet, strict=True):
            assert left.wrench.force.z + right.wrench.force.z == pytest.approx(600, abs=4.001)
        assert len(lab.received("head/camera/image_raw", Image)) == 20
        assert len(lab.received("motor_commands")) == len(lab.received("pelvis/imu/data")) == 200


@virtual_time
async def test_random_failures_stop_no_other_node():
    chance = random.Random(3)
    failed = Counter()
    async with harness(CONFIG, seed=3) as lab:
        names = [node.name for node in lab.graph.report().nodes]
        assert len(names) == 11
        for _ in range(40):
            await lab.advance(chance.expovariate(2))
            name = chance.choice([node.name for node in lab.graph.report().nodes if node.state == "running"])
            lab.fail(name, RuntimeError("killed at random"))
            failed[name] += 1
            before = {topic.name: topic.published for topic in lab.graph.report().topics}
            await lab.advance(0.05)
            after = {topic.name: topic.published for topic in lab.graph.report().topics}
            for node in lab.graph.report().nodes:
                if node.state == "running" and node.name.endswith(("foot_sensor", "imu_sensor")):
                    topic = node.name.replace("foot_sensor", "foot/wrench").replace("imu_sensor", "imu/data")
                    assert after[topic] - before[topic] >= 4, f"{node.name} goes on when {name} fails"
        await lab.advance(6)  # longer than the longest pause
        report = lab.graph.report()
        assert {node.state for node in report.nodes} == {"running"}
        assert all(line.published == line.delivered + line.dropped + line.queued for line in lab.ledger)
    assert {node.name: (node.failures, node.restarts) for node in report.nodes} == {
        name: (failed[name], failed[name]) for name in names
    }
    assert sum(line.level == "error" for line in lab.log) == 40


# Its joints.


def test_joint_position_and_velocity_follow_the_formula():
    def joints():
        return JointSimulator(joints=[HIP, KNEE], cadence_hz=0.5, phase=pi, prefix="left_", rate_hz=1000)

    messages = received(joints, "joint_states", JointState, 3.0)
    assert list(messages[0].name) == ["left_hip", "left_knee"]
    angles = np.array([each.position for each in messages])
    t = np.arange(1, len(messages) + 1) / 1000
    assert angles[:, 0] == pytest.approx(0.3 * np.sin(tau * 0.5 * t + pi + 0.5))
    assert angles[:, 1] == pytest.approx(0.4 + 0.2 * np.sin(tau * 0.5 * t + pi))
    speeds = np.array([each.velocity for each in messages])
    assert speeds[1:-1] == pytest.approx((angles[2:] - angles[:-2]) / 0.002, abs=1e-4)


def test_noise_keeps_joints_within_their_limits():
    still = {"name": "elbow", "amplitude": 0.0, "lower": -0.01, "upper": 0.05}

    def joints():
        return JointSimulator(joints=[still], noise=0.1)

    angles = [each.position[0] for each in received(joints, "joint_states", JointState, 5)]
    assert (min(angles), max(angles)) == (-0.01, 0.05)
    assert len(set(angles)) > 50


@pytest.mark.parametrize(
    ("joints", "reason"),
    [
        ([{**HIP, "amplitude": 1.5}], r"hip swings from -1\.5 to 1\.5, beyond its limits -1 to 1"),
        ([HIP, KNEE, HIP], "there are several joints called hip"),
        ([], "joints"),
        ([{**HIP, "amplitud": 1}], "amplitud"),
        ([{"name": "hip", **SHARED}], "amplitude is required"),
    ],
)
def test_joints_that_cannot_be_are_refused(joints, reason):
    with pytest.raises(InvalidParameter, match=reason):
        JointSimulator(joints=joints)


@virtual_time
async def test_restarted_simulator_is_in_phase_with_others():
    """Joints follow the run's time: a leg does not begin its stride anew because its program did."""
    async with harness(CONFIG) as lab:
        await lab.advance(1.3)
        lab.fail("left/joints", RuntimeError("loose contact"))
        await lab.advance(2)
        left = lab.received("left/joint_states", JointState)[-1]
        assert len(lab.received("left/joint_states")) < len(lab.received("right/joint_states")) == 330
        hip = stated("limb")[2]
        assert left.position[2] == pytest.approx(hip["amplitude"] * sin(tau * 0.5 * 3.3), abs=0.02)


# All joints in one message.


def parts(**parameters):
    return JointStatePublisher(source_list=["left/joints", "right/joints"], **parameters)


@virtual_time
async def test_silent_part_is_left_out_until_it_returns(golden):
    left = JointState(name=["l1", "l2"], position=[1.0, 2.0], velocity=[0.1, 0.2])
    right = JointState(name=["r1"], position=[3.0], velocity=[0.3])
    async with harness(parts(rate_hz=10, timeout_s=0.25)) as lab:
        await lab.advance(0.15)
        assert lab.received("joint_states") == [], "nothing is known yet"
        for _ in range(2):
            lab.publish("left/joints", left)
            lab.publish("right/joints", right)
            await lab.advance(0.1)
        both = lab.received("joint_states", JointState)[-1]
        assert (list(both.name), both.position.tolist()) == (["l1", "l2", "r1"], [1.0, 2.0, 3.0])
        assert both.velocity.tolist() == [0.1, 0.2, 0.3]
        for _ in range(4):
            lab.publish("left/joints", left)
            await lab.advance(0.1)
        assert list(lab.received("joint_states", JointState)[-1].name) == ["l1", "l2"]
        lab.publish("right/joints", right)
        await lab.advance(0.1)
        assert list(lab.received("joint_states", JointState)[-1].name) == ["l1", "l2", "r1"]
    golden("\n".join(line.event for line in lab.log))


def test_a_source_that_stands_twice_is_refused(golden):
    with golden.raises(InvalidParameter):
        JointStatePublisher(source_list=["a", "a"])


# Its sensors.


def test_foot_force_is_between_zero_and_weight():
    forces = [
        each.wrench.force.z
        for each in received(lambda: FootSensor(weight=500.0, noise=3.0), "foot/wrench", WrenchStamped, 10)
    ]
    assert min(forces) == 0.0
    assert 497 < max(forces) <= 503


def test_an_imu_stays_within_its_noise():
    for imu in received(lambda: ImuSensor(noise=0.2), "imu/data", Imu, 5):
        a, w = imu.linear_acceleration, imu.angular_velocity
        assert max(abs(a.x), abs(a.y), abs(a.z - 9.8)) <= 0.2 + 1e-12
        assert max(abs(w.x), abs(w.y), abs(w.z)) <= 0.1


def test_camera_frames_have_its_size_and_differ():
    frames = received(lambda: Camera(width=32, height=4), "camera/image_raw", Image, 0.5)
    assert [(each.width, each.height, each.step, len(each.data)) for each in frames] == [(32, 4, 96, 384)] * 5
    assert not np.array_equal(frames[0].data, frames[1].data)


@virtual_time
async def test_processor_receives_the_pelvis_and_all_joints():
    async with harness(CONFIG) as lab:
        await lab.advance(1)
        assert lab.node(SensorProcessor).status == "All sensors operational"
