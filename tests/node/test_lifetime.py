"""Life of a node: tasks and failures, also without a supervisor that receives them."""

import asyncio
from contextlib import suppress

import anyio

from busflow.bus.failure import Failure
from busflow.errors import NotRunning
from busflow.node.lifetime import NodeLifetime
from busflow.testing import virtual_time


def life(closed: list[str]) -> NodeLifetime:
    return NodeLifetime("Camera", "/camera", lambda: closed.append("closed"))


async def fails() -> None:
    raise ValueError("no picture")


def test_failure_closes_the_node_and_is_reported():
    closed: list[str] = []
    failures: list[Failure] = []
    for report in (None, failures.append):
        alive = life(closed)
        alive.on_failure = report
        alive.fail("Camera.take", ValueError("dark"))
    assert closed == ["closed", "closed"]
    assert [(each.node, each.origin, str(each.error)) for each in failures] == [("/camera", "Camera.take", "dark")]


@virtual_time
async def test_task_counts_until_its_end():
    closed: list[str] = []
    ended: list[int] = []
    unwatched, watched = life(closed), life(closed)
    watched.on_task_end = lambda: ended.append(watched.tasks)
    for alive in (unwatched, watched):
        async with anyio.create_task_group() as tasks:
            alive.adopt_tasks(tasks)
            alive.spawn(fails(), "take")
            assert alive.tasks == 1
        assert alive.tasks == 0
    assert ended == [0]
    assert closed == ["closed", "closed"]


@virtual_time
async def test_cancelled_task_is_no_failure():
    closed: list[str] = []
    alive = life(closed)
    with suppress(asyncio.CancelledError):
        async with anyio.create_task_group() as tasks:
            alive.adopt_tasks(tasks)
            alive.spawn(asyncio.sleep(9), "wait")
            await asyncio.sleep(1)
            tasks.cancel_scope.cancel()
    assert (alive.tasks, closed) == (0, [])


@virtual_time
async def test_without_a_task_group_nothing_is_spawned(golden):
    with golden.raises(NotRunning):
        life([]).spawn(fails(), "take")


async def endless() -> None:
    while True:
        with suppress(asyncio.CancelledError):
            await asyncio.sleep(60)


class Rest:
    """An awaitable that is no coroutine, as a hook may return."""

    def __await__(self):
        return asyncio.sleep(60).__await__()


@virtual_time
async def test_closed_tasks_end_with_their_next_cancellation():
    alive = life([])
    failed = []
    alive.on_failure = failed.append
    async with anyio.create_task_group() as tasks:
        alive.adopt_tasks(tasks)
        alive.spawn(endless(), "endless")
        tasks.start_soon(alive.awaited, Rest())
        await asyncio.sleep(1)
        alive.close_tasks()
        tasks.cancel_scope.cancel()
    assert alive.tasks == 0
    assert [each.origin for each in failed] == ["Camera (task endless)"]
