"""Feedback that comes after the result is read all the same, and holds no result back."""

import asyncio

import pytest

from busflow.actions.feedback import FeedbackQueue
from busflow.testing import harness, virtual_time
from tests.actions.conftest import Arm, Boss, MoveTo


@pytest.mark.parametrize(
    ("delay", "seen", "seconds"), [(0.1, [2, 1, 0], 3.1), (0.19, [2, 1, 0], 3.19), (0.5, [2, 1], 3.2)]
)
@virtual_time
async def test_late_feedback_is_waited_for_briefly(delay: float, seen: list[int], seconds: float):
    async with harness(Arm, Boss) as lab:
        lab.delay("arm/move/_action/feedback", delay)
        state_as_another_process_does(lab, feedback_count=3)
        async with lab.node(Boss).move.send(MoveTo.Goal(angle=3)) as going:
            assert [each.left async for each in going] == seen
            assert lab.clock.seconds() == pytest.approx(seconds)
            assert (await going.result()).angle == 3


@virtual_time
async def test_late_feedback_extends_the_wait_for_more():
    async with harness(Boss) as lab:
        queue = FeedbackQueue(10, lab.clock)
        queue.expect(3)
        for each in range(3):
            await lab.advance(0.15)
            assert queue.is_late
            queue.push(each)
        assert not queue.is_late, "all has come"


async def feedback_of(going):
    return [each.left async for each in going]


def state_as_another_process_does(lab, *, feedback_count):
    """Give each answer to `get_result` the number that a server of another process sends beside it."""

    def state(call):
        call.feedback_count = feedback_count

    lab.graph.bus.services["/arm/move/_action/get_result"].taps.append(state)


@virtual_time
async def test_result_does_not_wait_for_late_feedback():
    async with harness(Arm, Boss) as lab:
        lab.delay("arm/move/_action/feedback", 0.1)
        state_as_another_process_does(lab, feedback_count=3)
        async with lab.node(Boss).move.send(MoveTo.Goal(angle=3)) as going:
            await going.result()
            assert lab.clock.seconds() == 3
            reading = asyncio.create_task(feedback_of(going))
            await lab.advance(0)
        assert await reading == [2, 1], "it ends with the block"
        assert lab.clock.seconds() == 3
