"""The controller of the lab's humanoid: its PD law on the signed pitch, its limits, and its silence."""

from math import inf, nan
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import InvalidParameter
from busflow.msgs.geometry_msgs import Vector3
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_msgs import Float64
from busflow.msgs.trajectory_msgs import JointTrajectory
from busflow.testing import harness, virtual_time
from plugins.balance_controller import BalanceController
from plugins.humanoid_simulator import HumanoidSimulator

CONFIG = Path(__file__).parents[2] / "configs/lab_balance.yaml"
JOINTS = ["left_ankle_joint", "right_ankle_joint", "left_hip_joint", "right_hip_joint"]
angles = st.floats(-3, 3)


@virtual_time
async def commanded(pitch, speed, **parameters):
    """What the ankles and the hips are to do for a pitch and its speed; left and right get the same."""
    async with harness(BalanceController(**parameters)) as lab:
        lab.publish("imu/data", Imu(angular_velocity=Vector3(y=speed)))
        await lab.settle()
        lab.publish("pitch", Float64(data=pitch))
        await lab.settle()
        (command,) = lab.received("motor_commands", JointTrajectory)
    assert list(command.joint_names) == JOINTS
    (point,) = command.points
    left_ankle, right_ankle, left_hip, right_hip = point.positions.tolist()
    assert (left_ankle, left_hip) == (right_ankle, right_hip)
    return left_ankle, left_hip


def test_lean_and_its_speed_add_up():
    gains = {"ankle": {"p": 1.0, "d": 0.5}, "hip": {"p": 0.2, "d": 0.1}}
    assert commanded(0.13, 0.4, target=0.03, **gains) == pytest.approx((0.1 + 0.2, 0.02 + 0.04))
    assert commanded(-0.07, -0.4, target=0.03, **gains) == pytest.approx((-0.1 - 0.2, -0.02 - 0.04))


def test_pitch_at_its_target_is_left_alone():
    assert commanded(0.03, 0.0) == (0.0, 0.0)


@given(pitch=angles, speed=angles, limit=st.floats(0, 1.5))
def test_joints_keep_to_their_limit(pitch, speed, limit):
    ankle, hip = commanded(pitch, speed, ankle={"p": 5.0, "d": 5.0, "max_angle": limit})
    assert abs(ankle) <= limit
    assert abs(hip) <= 0.6


@pytest.mark.parametrize("nonsense", [nan, inf, -inf])
@virtual_time
async def test_non_finite_pitch_is_logged_and_ignored(nonsense):
    async with harness(BalanceController) as lab:
        lab.publish("pitch", Float64(data=nonsense))
        await lab.settle()
        assert lab.received("motor_commands") == []
        assert [(line.level, line.node) for line in lab.log] == [("warning", "/balance_controller")]


@virtual_time
async def test_silent_pitch_stops_the_motors_once(golden):
    async with harness(CONFIG, args={"push_force": [0.0, 0.0]}) as lab:
        await lab.advance(1)
        lab.set_parameters(HumanoidSimulator, rate_hz=0)
        await lab.advance(5)
        *before, last = lab.received("motor_commands", JointTrajectory)
    assert (len(before), list(last.points)) == (50, [])
    golden("\n".join(line.event for line in lab.log if line.level == "warning"))


@virtual_time
async def test_names_of_joints_are_parameters():
    names = {"ankle_joints": ["left_ankle_pitch_joint"], "hip_joints": []}
    async with harness(BalanceController(**names)) as lab:
        lab.publish("pitch", Float64(data=0.1))
        await lab.settle()
        (command,) = lab.received("motor_commands", JointTrajectory)
    assert list(command.joint_names) == ["left_ankle_pitch_joint"]
    assert len(command.points[0].positions) == 1


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"target": 0.5}, r"target must be at most 0\.2, got 0\.5"),
        ({"ankle": {"p": -1.0, "d": 0.0}}, r"ankle\.p must be at least 0, got -1"),
        ({"hip": {"p": 1.0}}, r"hip\.d is required"),
        ({"hip_joints": ["left_ankle_joint"]}, "a joint cannot follow two commands: left_ankle_joint"),
    ],
)
def test_gains_out_of_range_are_refused(given, reason):
    with pytest.raises(InvalidParameter, match=reason):
        BalanceController(**given)
