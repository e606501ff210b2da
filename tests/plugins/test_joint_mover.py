"""The joint mover reaches its goals over time, stops where it is canceled, and refuses what a joint cannot do."""

import asyncio
from pathlib import Path

import pytest

from busflow import GoalAborted, GoalCanceled, GoalRejected
from busflow.testing import harness, virtual_time
from plugins.joint_mover import JointMover, MoveJoint

CONFIG = Path(__file__).parents[2] / "configs/lab1_action.yaml"
LEFT = "left_elbow_joint"


def angles(lab):
    """The angles that were commanded."""
    return [round(float(each.points[0].positions[0]), 6) for each in lab.received("joint_commands")]


@virtual_time
async def test_joint_turns_at_its_speed():
    async with harness(JointMover) as lab:
        left = []
        goal = MoveJoint.Goal(joint=LEFT, angle=0.4, speed=2.0)
        result = await lab.run_action(
            MoveJoint, "joint_mover/move", goal, on_feedback=lambda each: left.append(each.left)
        )
        assert result.angle == 0.4
        assert lab.clock.seconds() == pytest.approx(0.2)
        assert angles(lab) == [0.1, 0.2, 0.3, 0.4, 0.4]
        assert left == pytest.approx([0.3, 0.2, 0.1, 0.0])


@virtual_time
async def test_canceled_joint_is_held_where_it_is():
    async with harness(JointMover) as lab:
        client = lab.action_client(MoveJoint, "joint_mover/move")
        async with client.send(MoveJoint.Goal(joint=LEFT, angle=1.0, speed=1.0)) as going:
            await lab.advance(0.22)
            await going.cancel()
            with pytest.raises(GoalCanceled) as caught:
                await going.result()
        assert caught.value.result.angle == pytest.approx(0.2)
        assert angles(lab)[-2:] == [0.2, 0.2]


@virtual_time
async def test_newer_goal_replaces_the_one_before(golden):
    async with harness(JointMover) as lab:
        client = lab.action_client(MoveJoint, "joint_mover/move")
        first = asyncio.ensure_future(client.run(MoveJoint.Goal(joint=LEFT, angle=1.0)))
        await lab.advance(1)
        assert (await client.run(MoveJoint.Goal(joint="right_elbow_joint", angle=0.1))).angle == 0.1
        with golden.raises(GoalAborted):
            await first


@pytest.mark.parametrize(
    ("goal", "why"),
    [
        ({"joint": "tail"}, "there is no joint 'tail', only left_elbow_joint, right_elbow_joint"),
        ({"joint": LEFT, "angle": 9.0}, "9 rad is beyond 1.5"),
        ({"joint": LEFT, "angle": float("nan")}, "nan rad is beyond 1.5"),
        ({"joint": LEFT, "angle": 1.0, "speed": 0.0}, "0 rad/s is no speed from 0 to 2"),
        ({"joint": LEFT, "angle": 1.0, "speed": 9.0}, "9 rad/s is no speed from 0 to 2"),
    ],
)
def test_impossible_goal_is_rejected(goal, why):
    @virtual_time
    async def rejected():
        async with harness(JointMover) as lab:
            with pytest.raises(GoalRejected, match=why):
                await lab.run_action(MoveJoint, "joint_mover/move", MoveJoint.Goal(**goal))

    rejected()


@virtual_time
async def test_lab_begins_where_the_joint_is():
    async with harness(CONFIG) as lab:
        await lab.advance(1)
        (now,) = [
            float(angle) for name, angle in zip(*_latest(lab.received("joint_states")), strict=True) if name == LEFT
        ]
        await lab.run_action(MoveJoint, "joint_mover/move", MoveJoint.Goal(joint=LEFT, angle=now + 0.5, speed=2.0))
        assert angles(lab)[0] == pytest.approx(now + 0.1, abs=1e-5)


def _latest(messages):
    return messages[-1].name, messages[-1].position
