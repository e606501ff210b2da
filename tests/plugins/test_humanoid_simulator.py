"""The lab's body: its sensors say what its physics does, it can be pushed and reset, and bad models are refused."""

import sys
from itertools import pairwise
from math import inf
from pathlib import Path

import numpy as np
import pytest

from busflow import Time
from busflow.cli import main
from busflow.errors import InvalidMessage, InvalidParameter, NodeFailed
from busflow.msgs.builtin_interfaces import Duration
from busflow.msgs.geometry_msgs import PoseStamped, WrenchStamped
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Header
from busflow.msgs.std_srvs import Trigger
from busflow.msgs.trajectory_msgs import JointTrajectory, JointTrajectoryPoint
from busflow.testing import harness, virtual_time
from plugins.humanoid_simulator import HumanoidSimulator, Push
from plugins.sensor_publisher import JOINT_NAMES
from tests.new_interpreter import printed_by

PROJECT = Path(__file__).parents[2]
CONFIG = PROJECT / "configs/lab_balance.yaml"
MODEL = PROJECT / "configs/humanoid/lab.xml"
SILENT = {"noise": {"imu": 0.0, "joints": 0.0}}
CALM = {"args": {"push_force": [0.0, 0.0]}}
STANDING_S = 3.0
"""So long the body stands by itself."""


def heights(lab):
    return [each.pose.position.z for each in lab.received("pelvis/pose", PoseStamped)]


def ahead(lab):
    """How far ahead of where it began the pelvis was, each time."""
    return [each.pose.position.x for each in lab.received("pelvis/pose", PoseStamped)]


def turn(seconds=0.0, **angles):
    within = Duration(sec=int(seconds), nanosec=round(seconds % 1 * 1e9))
    point = JointTrajectoryPoint(positions=list(angles.values()), time_from_start=within)
    return JointTrajectory(joint_names=list(angles), points=[point])


def changed(tmp_path, *changes):
    """A model file that differs from the lab's."""
    text = MODEL.read_text("utf-8")
    for before, after in changes:
        assert before in text
        text = text.replace(before, after)
    file = tmp_path / "body.xml"
    file.write_text(text, "utf-8")
    return str(file)


# What it publishes.


@virtual_time
async def test_sensors_are_those_of_the_lab():
    async with harness(HumanoidSimulator()) as lab:
        await lab.advance(1)
        joints = lab.received("joint_states", JointState)
        assert len(joints) == len(lab.received("imu/data", Imu)) == len(heights(lab)) == 50
        assert {frozenset(each.name) for each in joints} == {frozenset(JOINT_NAMES)}


@virtual_time
async def test_velocity_is_the_change_of_position():
    async with harness(HumanoidSimulator(**SILENT)) as lab:
        lab.publish("motor_commands", turn(0.5, left_shoulder_joint=-0.5))
        await lab.advance(0.6)
        joints = lab.received("joint_states", JointState)
    shoulder = joints[0].name.index("left_shoulder_joint")
    for before, after in pairwise(joints[5:25]):
        mean = (before.velocity[shoulder] + after.velocity[shoulder]) / 2
        assert (after.position[shoulder] - before.position[shoulder]) / 0.02 == pytest.approx(mean, abs=0.05)
    assert joints[10].velocity[shoulder] < -0.5
    assert joints[10].effort[shoulder] < -1.0, "the motor lifts the arm"


@virtual_time
async def test_feet_bear_the_weight():
    async with harness(HumanoidSimulator(mass=80.0, **SILENT)) as lab:
        await lab.advance(1)
        for side in ("left", "right"):
            wrench = lab.received(f"{side}/foot/wrench", WrenchStamped)[-1]
            assert wrench.header.frame_id == f"{side}_foot_link"
            assert wrench.wrench.force.z == pytest.approx(80 * 9.81 / 2, rel=0.05)  # without the feet themselves


@virtual_time
async def test_imu_feels_gravity_and_the_lean():
    async with harness(HumanoidSimulator(**SILENT)) as lab:
        await lab.advance(STANDING_S)
        imu, pose = lab.received("imu/data", Imu)[-1], lab.received("pelvis/pose", PoseStamped)[-1]
    assert imu.linear_acceleration.z == pytest.approx(9.81, abs=0.2)
    assert imu.orientation == pose.pose.orientation
    assert imu.orientation.y * pose.pose.position.x > 0, "it leans to where it falls"


@virtual_time
async def test_noise_stays_within_its_limits():
    async def rotations(imu):
        async with harness(HumanoidSimulator(noise={"imu": imu})) as lab:
            await lab.advance(1)
            return np.array([each.angular_velocity.x for each in lab.received("imu/data", Imu)])

    off = await rotations(0.4) - await rotations(0.0)
    assert 0.1 < np.abs(off).max() <= 0.2


# What can be done to it.


@virtual_time
async def test_body_alone_falls_and_says_when():
    async with harness(HumanoidSimulator()) as lab:
        await lab.advance(10)
        (line,) = lab.log
        assert (line.level, [*line.values]) == ("warning", ["stood_s"])
        assert STANDING_S < line.values["stood_s"] < 10
        assert heights(lab)[-1] < 0.4


@pytest.mark.parametrize("force", [80.0, -80.0])
@virtual_time
async def test_push_moves_the_pelvis_its_way(force):
    async with harness(CONFIG, **CALM) as lab:
        await lab.advance(2)
        answer = await lab.call(Push, "humanoid_simulator/push", Push.Request(force=force, duration=0.1))
        assert (answer.success, answer.message) == (True, f"{force:g} N for 0.1 s")
        await lab.advance(3)
        before, *moved = ahead(lab)[99:]
        assert max(moved, key=lambda x: abs(x - before)) - before == pytest.approx(force * 0.0005, rel=0.5)
        assert min(heights(lab)) > 0.85, "and it stands"


@pytest.mark.parametrize(("duration", "periods"), [(0.02, 1), (0.05, 3), (0.1, 5)])
@virtual_time
async def test_push_lasts_until_a_period_ends(duration, periods):
    async with harness(HumanoidSimulator(**SILENT)) as lab:
        await lab.call(Push, "humanoid_simulator/push", Push.Request(force=50.0, duration=duration))
        await lab.advance(0.3)
        pushed = [each.linear_acceleration.x > 0.4 for each in lab.received("imu/data", Imu)]
    assert pushed == [True] * periods + [False] * (15 - periods)


@pytest.mark.parametrize("request_", [{"force": 1001.0}, {"force": -inf}, {"force": 10.0, "duration": 0.0}])
def test_push_out_of_range_is_refused(request_, golden):
    with golden.raises(InvalidMessage):
        Push.Request(**request_)


@virtual_time
async def test_random_pushes_do_not_depend_on_noise():
    async def pushed(**noise):
        pushes = {"push_force": [20.0, 60.0], "push_every_s": [0.2, 0.4]}
        async with harness(HumanoidSimulator(noise=noise, **pushes), seed=4) as lab:
            await lab.advance(2.5)
            return heights(lab)

    assert await pushed(imu=0.0) == await pushed(imu=0.5, joints=0.01)


@virtual_time
async def test_reset_repeats_the_run():
    async with harness(HumanoidSimulator(push_force=[40.0, 60.0], push_every_s=[0.5, 1.0])) as lab:
        await lab.advance(2.5)
        lab.set_parameters(HumanoidSimulator, mass=90.0)
        await lab.advance(0.51)
        lab.set_parameters(HumanoidSimulator, mass=64.0)
        answer = await lab.call(Trigger, "humanoid_simulator/reset")
        assert answer.message == "stands anew after 3 s"
        reset = lab.graph.clock.now()
        await lab.advance(2.5)
        imus = lab.received("imu/data", Imu)
        assert (Time.from_msg(imus[150].header.stamp) - reset).seconds == 0.02, "a period after the reset"
        readings = [each.replace(header=Header()) for each in imus]
        assert readings[:125] == readings[150:]
        assert len({each.linear_acceleration.x for each in readings[:125]}) == 125


@virtual_time
async def test_joints_reach_their_angle_in_time():
    async with harness(HumanoidSimulator(**SILENT)) as lab:
        lab.publish("motor_commands", turn(1.0, left_elbow_joint=-1.0, right_elbow_joint=-0.5))
        await lab.advance(0.5)
        half = dict(zip(JOINT_NAMES, [0.0] * 10, strict=True)) | positions(lab)
        await lab.advance(1.0)
        there = positions(lab)
    assert half["left_elbow_joint"] == pytest.approx(-0.5, abs=0.1)
    assert there["left_elbow_joint"] == pytest.approx(-1.0, abs=0.1)
    assert there["right_elbow_joint"] == pytest.approx(-0.5, abs=0.1)
    assert there["left_shoulder_joint"] == pytest.approx(0.0, abs=0.2)


def positions(lab):
    joints = lab.received("joint_states", JointState)[-1]
    return dict(zip(joints.name, joints.position.tolist(), strict=True))


@virtual_time
async def test_command_without_points_holds_the_joints():
    async with harness(HumanoidSimulator(**SILENT)) as lab:
        lab.publish("motor_commands", turn(1.0, left_elbow_joint=-1.0))
        await lab.advance(0.5)
        lab.publish("motor_commands", JointTrajectory())
        await lab.advance(1)
        assert positions(lab)["left_elbow_joint"] == pytest.approx(-0.5, abs=0.15)


@virtual_time
async def test_further_points_are_not_followed_silently(golden):
    first, second = turn(0.0, left_elbow_joint=-0.4), turn(0.5, left_elbow_joint=-1.2)
    async with harness(HumanoidSimulator(**SILENT)) as lab:
        lab.publish("motor_commands", first.replace(points=[*first.points, *second.points]))
        await lab.advance(1)
        golden("\n".join(f"{each.level}: {each.event}" for each in lab.log))
        assert positions(lab)["left_elbow_joint"] == pytest.approx(-0.4, abs=0.1)


@virtual_time
async def test_pushed_robot_slides_on_ice_alone():
    async def slid(friction):
        async with harness(CONFIG, **CALM) as lab:
            lab.set_parameters(HumanoidSimulator, friction=friction)
            await lab.advance(2)
            await lab.call(Push, "humanoid_simulator/push", Push.Request(force=100.0))
            await lab.advance(4)
            return ahead(lab)[-1]

    assert await slid(1.0) < 0.05 < 0.1 < await slid(0.01)


@virtual_time
async def test_rate_of_zero_is_a_pause():
    async with harness(HumanoidSimulator) as lab:
        await lab.advance(1)
        lab.set_parameters(HumanoidSimulator, rate_hz=0)
        await lab.advance(60)
        assert len(heights(lab)) == 50
        lab.set_parameters(HumanoidSimulator, rate_hz=100)
        await lab.advance(1)
        assert len(heights(lab)) == 150
        assert heights(lab)[-1] > 0.9


# What is refused.


@virtual_time
async def test_joint_that_the_model_lacks_fails_the_node():
    async with harness(HumanoidSimulator, expect_failure=HumanoidSimulator) as lab:
        lab.publish("motor_commands", turn(left_hip_pitch_joint=0.1, left_hip_joint=0.1))
        await lab.advance(0.1)
    assert "left_hip_pitch_joint; " in lab.log[-1].event


@virtual_time
async def test_unstable_physics_fails_with_time_and_reason(tmp_path):
    wild = changed(tmp_path, ('kp="300" kv="24"', 'kp="3e9" kv="0"'), ('<position forcerange="-150 150"/>', ""))
    with pytest.raises(NodeFailed) as failure:
        async with harness(HumanoidSimulator(model=wild)) as lab:
            await lab.advance(1)
    assert " 0.02 s " in str(failure.value)
    assert "BADQACC" in str(failure.value)


@virtual_time
async def test_nan_of_a_command_fails_the_node(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    async with harness(HumanoidSimulator, expect_failure=HumanoidSimulator) as lab:
        await lab.advance(1)
        lab.publish("motor_commands", turn(left_hip_joint=float("nan")))
        await lab.advance(1)
    assert " 1.02 s " in lab.log[-1].event
    assert list(tmp_path.iterdir()) == [], "MuJoCo writes no log of its own"


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ([("</worldbody>", "</worldbdy>")], r"body\.xml:\d+: XML parse error"),
        ([('joint="left_knee_joint"', 'joint="left_kneee_joint"')], r"body\.xml:\d+: .*'left_kneee_joint'"),
        ([('<gyro name="rotation"', '<gyro name="rot"')], r"body\.xml: the model has no sensor rotation"),
        ([('name="floor"', 'name="ground"')], r"body\.xml: the model has no geom floor"),
        ([('<freejoint name="pelvis"/>', "")], r"body\.xml: the first joint of the model must be free"),
    ],
)
def test_broken_model_is_refused_with_file_and_line(changes, reason, tmp_path):
    with pytest.raises(InvalidParameter, match=reason):
        HumanoidSimulator(model=changed(tmp_path, *changes))


def check(capsys, *words):
    code = main(["check", str(CONFIG), *words])
    return code, capsys.readouterr().out


def test_check_names_missing_model_at_its_place(capsys, tmp_path):
    text = CONFIG.read_text("utf-8").replace("configs/humanoid/lab.xml", "nowhere.xml")
    file = tmp_path / "lab.yaml"
    file.write_text(text.replace("../plugins", str(PROJECT / "plugins")), "utf-8")
    assert main(["check", str(file)]) == 3
    assert "lab.yaml:33:14: error: /humanoid_simulator: model: " in capsys.readouterr().out


def test_check_says_how_to_install_mujoco(capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)  # as if it were not installed
    code, printed = check(capsys)
    assert code == 3
    assert "lab_balance.yaml:33:14: error: /humanoid_simulator: model: " in printed
    assert "pip install '.[sim]'" in printed


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"push_force": [180.0, 60.0]}, "push_force: the least must come first, got 180 before 60"),
        ({"push_force": [60.0, 2000.0]}, r"push_force\[1\] must be at most 1000, got 2000"),
        ({"push_force": [60.0]}, "push_force must have at least 2 items, has 1"),
        ({"push_every_s": [0.0, 1.0]}, r"push_every_s\[0\] must be at least 0\.1, got 0"),
        ({"mass": 5.0}, "mass must be at least 20, got 5"),
    ],
)
def test_parameters_out_of_range_are_refused(given, reason):
    with pytest.raises(InvalidParameter, match=reason):
        HumanoidSimulator(**given)


def test_nothing_but_a_body_imports_mujoco():
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); from busflow.cli import main\n"
        "import plugins.humanoid_simulator; main(['check', f'{sys.argv[1]}/configs/lab1_motors.yaml'])\n"
        "print('mujoco' in sys.modules)"
    )
    assert printed_by(code, str(PROJECT)) == "no problems\nFalse"
