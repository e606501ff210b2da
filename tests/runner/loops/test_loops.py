"""Orders of events and waiting tasks of an event loop.

Tests of `schedule.py` and `stalls.py`.
"""

import asyncio

from busflow.runner.loops.schedule import Schedule
from busflow.runner.loops.stalls import waiting
from busflow.testing import virtual_time


@virtual_time
async def test_unfinished_task_shows_its_waiting_line(golden):
    async def wait():
        await asyncio.Event().wait()

    task = asyncio.create_task(wait(), name="waiter")
    await asyncio.sleep(0)
    (line,) = [each for each in waiting(asyncio.get_running_loop()) if "'waiter'" in each]
    task.cancel()
    golden(line)


@virtual_time
async def test_gathered_tasks_are_named(golden):
    never = asyncio.Event()
    parts = [asyncio.create_task(never.wait(), name=name) for name in ("one", "two")]

    async def gathered():
        await asyncio.gather(*parts)

    whole = asyncio.create_task(gathered(), name="whole")
    await asyncio.sleep(0)
    lines = waiting(asyncio.get_running_loop())
    for each in (whole, *parts):
        each.cancel()
    golden("\n".join(line for line in lines if line.startswith("task 'whole'")))


def drawn(seed):
    schedule = Schedule(seed)
    return [schedule.share(10) for _ in range(50)]


def test_schedule_of_a_seed_is_always_the_same():
    assert drawn(1) == drawn(1) != drawn(2)


def test_schedule_without_seed_keeps_plain_order():
    plain = Schedule()
    assert {plain.share(10) for _ in range(50)} == {10}
