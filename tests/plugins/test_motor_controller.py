"""The lab's motor controller: its PD law, its limits, its silence, and that a run is the same every time."""

from itertools import pairwise
from math import inf, nan
from pathlib import Path

import pytest
from hypothesis import given, settings
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
    """What a command says of (the ankles, the hips); left and right are told the same."""
    (point,) = command.points
    left_ankle, right_ankle, left_hip, right_hip = point.positions.tolist()
    assert (left_ankle, left_hip) == (right_ankle, right_hip)
    return left_ankle, left_hip


@virtual_time
async def commanded(*told, **parameters):
    """What ankles and hips are told of each balance, which come every tenth of a second."""
    async with harness(MotorController(**parameters)) as lab:
        for balance in told:
            lab.publish("balance_state", Float64(data=balance))
            await lab.advance(PERIOD_S)
    return [angles(each) for each in lab.received("motor_commands", JointTrajectory)]


@virtual_time
async def test_a_command_names_the_joints_of_the_lab_and_when_to_be_there():
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


def test_the_first_balance_moves_nothing_since_nothing_is_known_of_its_change():
    assert commanded(0.7) == [(0.0, 0.0)]


def test_a_constant_balance_is_answered_in_proportion():
    *_, last = commanded(*[0.5] * 5, ankle={"p": 0.4, **SWIFT}, hip={"p": 0.2, **SWIFT})
    assert last == pytest.approx((0.2, 0.1))


def test_a_balance_at_its_target_is_left_alone():
    assert set(commanded(*[0.25] * 5, target=0.25)) == {(0.0, 0.0)}


def test_a_change_is_answered_by_its_speed_on_the_run_s_clock():
    """From 0.1 to 0.3 in a tenth of a second is 2 per second; then it does not change."""
    ankle, hip = {"p": 0.0, "d": 0.03, **SWIFT}, {"p": 0.0, "d": 0.01, **SWIFT}
    moves = commanded(0.1, 0.3, 0.3, ankle=ankle, hip=hip)
    assert moves == [(0.0, 0.0), pytest.approx((0.06, 0.02)), pytest.approx((0.0, 0.0), abs=1e-12)]


def test_proportion_and_change_add_up():
    ankle = {"p": 0.5, "d": 0.1, **SWIFT}
    _, (angle, _) = commanded(0.1, 0.3, ankle=ankle)
    assert angle == pytest.approx(0.5 * 0.3 + 0.1 * 2)


@given(told=balances, p=st.floats(0, 10), d=st.floats(0, 10), angle=st.floats(0, 1.5), speed=st.floats(0, 20))
@settings(max_examples=50, deadline=None)
def test_no_joint_goes_further_or_faster_than_its_limits(told, p, d, angle, speed):
    ankles = [ankle for ankle, _ in commanded(*told, ankle={"p": p, "d": d, "max_angle": angle, "max_speed": speed})]
    assert len(ankles) == len(told)
    assert max(map(abs, ankles)) <= angle + 1e-12
    steps = [abs(after - before) for before, after in pairwise(ankles)]
    assert all(step <= speed * PERIOD_S + 1e-12 for step in steps)


@virtual_time
async def test_a_long_silence_is_not_followed_by_a_leap():
    async with harness(MotorController(reach_s=0.1, ankle={"p": 10, "max_angle": 1.5, "max_speed": 1.0})) as lab:
        lab.publish("balance_state", Float64(data=0.0))
        await lab.advance(60)
        lab.publish("balance_state", Float64(data=1.0))
        await lab.settle()
        ankle, _ = angles(lab.received("motor_commands")[-1])
    assert ankle == pytest.approx(0.1)


@virtual_time
async def test_a_limit_that_is_set_while_it_runs_is_kept_to_at_the_allowed_speed():
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
async def test_what_is_no_balance_is_told_and_not_acted_upon(nonsense):
    async with harness(MotorController) as lab:
        for balance in (0.2, nonsense, 0.2):
            lab.publish("balance_state", Float64(data=balance))
            await lab.advance(PERIOD_S)
        assert len(lab.received("motor_commands")) == 2
    assert [line.event for line in lab.log] == ["not a balance: the joints stay where they are"]


@virtual_time
async def test_of_balances_that_come_at_once_the_newest_counts():
    async with harness(MotorController(ankle={"d": 0.0})) as lab:
        for balance in (0.2, 0.9, 0.4):
            lab.publish("balance_state", Float64(data=balance))
        await lab.advance(PERIOD_S)
        lab.publish("balance_state", Float64(data=0.4))
        await lab.settle()
        first, second = (angles(each) for each in lab.received("motor_commands"))
    assert (first, second[0]) == ((0.0, 0.0), pytest.approx(0.4 * 0.4))


@virtual_time
async def test_when_the_balance_falls_silent_the_motors_are_told_once_to_hold_still():
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
    assert [line.event for line in lab.log if line.node == "/motor_controller"] == [
        "the balance is silent: the joints stay where they are"
    ]


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
def test_gains_and_limits_have_ranges_and_no_joint_has_two_commands(given, reason):
    with pytest.raises(InvalidParameter, match=reason):
        MotorController(**given)


@virtual_time
async def test_the_joints_are_the_robot_s_and_stay_so_while_it_runs():
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
