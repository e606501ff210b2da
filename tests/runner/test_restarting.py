"""A part of a run lives again as its policy says, until it ends for good or is asked to stop."""

import asyncio

import pytest

from busflow.clock import SimClock
from busflow.launchfile.model.supervision import Condition, RestartPolicy
from busflow.log import Log
from busflow.runner.restarting import Restarting
from busflow.testing import virtual_time


class Lamp(Restarting):
    """A part that is ready for a second, and then fails if it is to."""

    def __init__(self, when, *, failing=False):
        self.log, self.failing, self.begun_s = [], failing, []
        policy = RestartPolicy(when, most=3, first_s=1, longest_s=2, window_s=10)
        super().__init__("/lamp", policy, self.now_s, Log(SimClock(), sinks=(self.log.append,)).bind("/lamp"))

    def now_s(self):
        return asyncio.get_running_loop().time()

    async def _live_once(self):
        if not await self._wait_for_others():
            return None
        self.begun_s.append(self.now_s())
        self._meet(Condition.READY)
        await asyncio.sleep(1)
        return self._next_pause_s(failed=self.failing)


@pytest.mark.parametrize(
    ("when", "failing", "begun_s"),
    [
        ("never", True, [0]),
        ("on-failure", False, [0]),
        ("on-failure", True, [0, 2, 5, 8]),
        ("always", False, [0, 2, 5, 8]),
    ],
)
@virtual_time
async def test_part_lives_again_until_the_limit(when, failing, begun_s):
    lamp = Lamp(when, failing=failing)
    await lamp.live()
    assert (lamp.begun_s, lamp.restarts, lamp.ended.is_set()) == (begun_s, len(begun_s) - 1, True)
    limit = ["given up after 3 restarts within 10 s"] if len(begun_s) > 1 else []
    assert [record.event for record in lamp.log] == limit


@pytest.mark.parametrize(("after_s", "restarts"), [(0.5, 0), (1.5, 1)], ids=["in a life", "in a pause"])
@virtual_time
async def test_stop_is_followed_by_no_other_life(after_s, restarts):
    lamp = Lamp("always")
    living = asyncio.create_task(lamp.live())
    await asyncio.sleep(after_s)
    lamp.ask_to_stop()
    await living
    assert (lamp.begun_s, lamp.restarts, lamp.now_s()) == ([0], restarts, max(after_s, 1))


@virtual_time
async def test_part_waits_for_a_condition_until_it_is_asked_to_stop():
    first = Lamp("never")
    second, third = Lamp("never"), Lamp("never")
    second.depend({"/lamp": first}, {"/lamp": Condition.READY, "/elsewhere": Condition.READY})
    third.depend({"/lamp": first}, {"/lamp": Condition.FIRST_MESSAGE})
    living = [asyncio.create_task(each.live()) for each in (second, third)]
    await asyncio.sleep(5)
    assert (second.begun_s, third.begun_s) == ([], [])
    living.append(asyncio.create_task(first.live()))
    await asyncio.sleep(0.5)
    third.ask_to_stop()
    await asyncio.gather(*living)
    assert (second.begun_s, third.begun_s) == ([5], [])
