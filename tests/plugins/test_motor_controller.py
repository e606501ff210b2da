"""The lab's motor controller: its PD law, its limits, its silence, and that a run is the same every time."""

from itertools import pairwise
from math import inf, nan
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import Time
from busflow.errors import InvalidParameter
from busflow.msgs.std_msgs import Float64
from busflow.msgs.trajectory_msgs import JointTrajectory
from busflow.testing import harness, virtual_time
from plugins.motor_controller import MotorController
from plugins.sensor_publisher import JOINT_NAMES, SensorPublisher

CONFIG = Path(__file__).parents[2] / "configs/lab1_motors.yaml"
PERIOD_S = 0.1
SWIFT = {"max_speed": 20.0, "max_angle": 1.5}
"""Limits that a small change does not reach."""

balances = st.lists(st.floats(min_value=0, max_value=1), min_size=1, max_size=30)


def angles(command):
    """What a command says of (the ankles, the hips); left and right get the same."""
    (point,) = command.points
    left_ankle, right_ankle, left_hip, right_hip = point.positions.tolist()
    assert (left_ankle, left_hip) == (right_ankle, right_hip)
    return left_ankle, left_hip


@virtual_time
async def commanded(*sent, **parameters):
    """Return the commands to ankles and hips for balances sent every tenth of a second."""
    async with harness(MotorController(**parameters)) as lab:
        for balance in sent:
            lab.publish("balance_state", Float64(data=balance))
            await lab.advance(PERIOD_S)
    return [angles(each) for each in lab.received("motor_commands", JointTrajectory)]


@virtual_time
async def test_command_names_joints_and_time():
    async with harness(MotorController(reach_s=0.25)) as lab:
        began = lab.graph.clock.now()
        await lab.advance(1.5)
        lab.publish("balance_state", Float64(data=0.3))
        await lab.settle()
        (command,) = lab.received("motor_commands", JointTrajectory)
    assert list(command.joint_names) == ["left_ankle_joint", "right_ankle_joint", "left_hip_joint", "right_hip_joint"]
    assert set(command.joint_names) <= set(JOINT_NAMES), "as the sensors call them"
    assert (Time.from_msg(command.header.stamp) - began).seconds == 1.5
    (point,) = command.points
    assert (point.time_from_start.sec, point.time_from_start.nanosec) == (0, 250_000_000)


def test_first_balance_has_no_change_term():
    assert commanded(0.7) == [(0.0, 0.0)]


def test_a_constant_balance_is_answered_in_proportion():
    *_, last = commanded(*[0.5] * 5, ankle={"p": 0.4, **SWIFT}, hip={"p": 0.2, **SWIFT})
    assert last == pytest.approx((0.2, 0.1))


def test_a_balance_at_its_target_is_left_alone():
    assert set(commanded(*[0.25] * 5, target=0.25)) == {(0.0, 0.0)}


def test_change_is_measured_by_the_run_s_clock():
    """From 0.1 to 0.3 in a tenth of a second is 2 per second; then it does not change."""
    ankle, hip = {"p": 0.0, "d": 0.03, **SWIFT}, {"p": 0.0, "d": 0.01, **SWIFT}
    moves = commanded(0.1, 0.3, 0.3, ankle=ankle, hip=hip)
    assert moves == [(0.0, 0.0), pytest.approx((0.06, 0.02)), pytest.approx((0.0, 0.0), abs=1e-12)]


def test_proportion_and_change_add_up():
    ankle = {"p": 0.5, "d": 0.1, **SWIFT}
    _, (angle, _) = commanded(0.1, 0.3, ankle=ankle)
    assert angle == pytest.approx(0.5 * 0.3 + 0.1 * 2)


@given(sent=balances, p=st.floats(0, 10), d=st.floats(0, 10), angle=st.floats(0, 1.5), speed=st.floats(0, 20))
def test_joints_keep_to_angle_and_speed_limits(sent, p, d, angle, speed):
    ankles = [ankle for ankle, _ in commanded(*sent, ankle={"p": p, "d": d, "max_angle": angle, "max_speed": speed})]
    assert len(ankles) == len(sent)
    assert max(map(abs, ankles)) <= angle + 1e-12
    steps = [abs(after - before) for before, after in pairwise(ankles)]
    assert all(step <= speed * PERIOD_S + 1e-12 for step in steps)


@virtual_time
async def test_long_silence_is_not_followed_by_a_jump():
    async with harness(MotorController(reach_s=0.1, ankle={"p": 10, "max_angle": 1.5, "max_speed": 1.0})) as lab:
        lab.publish("balance_state", Float64(data=0.0))
        await lab.advance(60)
        lab.publish("balance_state", Float64(data=1.0))
        await lab.settle()
        ankle, _ = angles(lab.received("motor_commands")[-1])
    assert ankle == pytest.approx(0.1)


@virtual_time
async def test_changed_limit_is_approached_at_allowed_speed():
    async with harness(MotorController(ankle={"p": 1.0, "max_angle": 0.5, "max_speed": 1.0})) as lab:
        for max_angle in (0.5, 0.1):
            lab.set_parameters(MotorController, {"ankle.max_angle": max_angle})
            for _ in range(6):
                lab.publish("balance_state", Float64(data=1.0))
                await lab.advance(PERIOD_S)
        ankles = [angles(each)[0] for each in lab.received("motor_commands")]
    assert ankles == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.4, 0.3, 0.2, 0.1, 0.1, 0.1])


@pytest.mark.parametrize("nonsense", [nan, inf, -inf])
@virtual_time
async def test_non_finite_balance_is_logged_and_ignored(nonsense):
    async with harness(MotorController) as lab:
        for balance in (0.2, nonsense, 0.2):
            lab.publish("balance_state", Float64(data=balance))
            await lab.advance(PERIOD_S)
        assert len(lab.received("motor_commands")) == 2
    assert [(line.level, line.node) for line in lab.log] == [("warning", "/motor_controller")]


@virtual_time
async def test_newest_of_simultaneous_balances_counts():
    async with harness(MotorController(ankle={"d": 0.0})) as lab:
        for balance in (0.2, 0.9, 0.4):
            lab.publish("balance_state", Float64(data=balance))
        await lab.advance(PERIOD_S)
        lab.publish("balance_state", Float64(data=0.4))
        await lab.settle()
        first, second = (angles(each) for each in lab.received("motor_commands"))
    assert (first, second[0]) == ((0.0, 0.0), pytest.approx(0.4 * 0.4))


@virtual_time
async def test_silent_balance_stops_the_motors_once(golden):
    async with harness(CONFIG, seed=3) as lab:
        await lab.advance(1.05)
        before = angles(lab.received("motor_commands")[-1])
        lab.set_parameters(SensorPublisher, rate_hz=0)
        await lab.advance(10)
        *_, last = lab.received("motor_commands", JointTrajectory)
        assert len(lab.received("motor_commands")) == 10 + 1
        assert (list(last.joint_names), list(last.points)) == ([], [])
        lab.set_parameters(SensorPublisher, rate_hz=10)
        await lab.advance(PERIOD_S)
        assert angles(lab.received("motor_commands")[-1]) == before, "it begins where the joints stayed"
    golden("\n".join(line.event for line in lab.log if line.node == "/motor_controller"))


@pytest.mark.parametrize(
    ("given", "reason"),
    [
        ({"target": 1.5}, r"target must be at most 1, got 1\.5"),
        ({"ankle": {"p": -1}}, r"ankle\.p must be at least 0, got -1"),
        ({"hip": {"max_angle": 2}}, r"hip\.max_angle must be at most 1\.5, got 2"),
        ({"reach_s": 0}, r"reach_s must be at least 0\.001"),
        ({"hip_joints": ["left_ankle_joint"]}, "a joint cannot follow two commands: left_ankle_joint"),
    ],
)
def test_invalid_gains_and_repeated_joints_are_refused(given, reason):
    with pytest.raises(InvalidParameter, match=reason):
        MotorController(**given)


@virtual_time
async def test_joint_names_are_read_only():
    async with harness(MotorController(ankle_joints=["a"], hip_joints=["b", "c"])) as lab:
        lab.publish("balance_state", Float64(data=0.3))
        await lab.settle()
        (command,) = lab.received("motor_commands", JointTrajectory)
        assert list(command.joint_names) == ["a", "b", "c"]
        assert len(command.points[0].positions) == 3
        with pytest.raises(InvalidParameter, match="ankle_joints is read-only"):
            lab.set_parameters(MotorController, ankle_joints=["d"])


@virtual_time
async def run_of_the_lab(seed):
    async with harness(CONFIG, seed=seed) as lab:
        await lab.advance(30)
        assert lab.ledger.dropped == 0
    return lab.received("motor_commands", JointTrajectory)


def test_a_seed_decides_every_command():
    commands = run_of_the_lab(5)
    assert len(commands) == 300
    assert commands == run_of_the_lab(5)
    assert commands != run_of_the_lab(6)
