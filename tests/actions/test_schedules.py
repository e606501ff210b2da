"""Under any order of finish, cancel, timeout and restart a goal has one end, and the accounts balance."""

import asyncio

import pytest

from busflow import ActionError, GoalState, supervised
from busflow.testing import explore, harness
from tests.actions.conftest import Arm, Boss, MoveTo, balanced

ENDS = {GoalState.SUCCEEDED, GoalState.CANCELED, GoalState.ABORTED}
ALLOWED = {1, "GoalCanceled", "GoalTimeout", "ActionGone", "ActionUnavailable"}


async def end_of(move, *, cancel_after=None, limit=None):
    """How a goal of one second ended for its client."""
    try:
        async with move.send(MoveTo.Goal(angle=1), timeout=limit) as going:
            if cancel_after is not None:
                await asyncio.sleep(cancel_after)
                await going.cancel()
            return (await going.result()).angle
    except ActionError as error:
        return type(error).__name__


@explore(schedules=50)
async def test_orders_have_one_end_for_each_goal():
    await ends_once_each()


@pytest.mark.long
@explore(schedules=1000)
async def test_thousand_orders_have_one_end_for_each_goal():
    await ends_once_each()


async def ends_once_each():
    async with harness(supervised(Arm, restart="always"), Boss) as lab:
        move, arm = lab.node(Boss).move, lab.node(Arm)
        ends = []
        for cancel_after, limit, fail in ((1, None, False), (None, 1, False), (1, 1, False), (1, 1, True)):
            task = asyncio.ensure_future(end_of(move, cancel_after=cancel_after, limit=limit))
            if fail:
                asyncio.get_running_loop().call_later(1, lab.fail, "arm", RuntimeError("broken"))
            await lab.advance(2)
            ends.append(task.result())
        assert all(each in ALLOWED for each in ends), ends
        await lab.advance(1)
        assert arm.move.goals == lab.node(Arm).move.goals == ()
        assert balanced(lab)
        states = terminal_states(lab)
        assert len(states) == 4
        assert all(len(each) == 1 for each in states.values()), states


def terminal_states(lab):
    """The terminal states that were published of each goal."""
    found = {}
    for message in lab.received("arm/move/_action/status"):
        for each in message.status_list:
            seen = found.setdefault(each.goal_info.goal_id.uuid.tobytes(), set())
            if each.status in ENDS:
                seen.add(each.status)
    return found
