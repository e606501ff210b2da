"""Virtual tests: what is written without async is told at once, in one sentence."""

import asyncio
import functools
import signal
import threading
from math import inf

import pytest

from busflow import Node
from busflow.errors import InvalidDeclaration, NotRunning
from busflow.testing import explore, harness, virtual_time


class Nothing(Node):
    """Does nothing."""


def plain() -> None:
    """A test without async."""


@pytest.mark.parametrize("decorate", [virtual_time, virtual_time(seed=1), explore, explore(schedules=2)])
def test_plain_def_is_refused_when_decorated(decorate, golden):
    with golden.raises(InvalidDeclaration):
        decorate(plain)


def test_virtual_test_in_a_running_loop_is_refused(golden):
    @virtual_time
    async def inner() -> None:
        """Does nothing."""

    async def outer() -> None:
        inner()

    with golden.raises(NotRunning):
        asyncio.run(outer())


def test_async_test_under_another_decorator_is_accepted():
    async def test() -> int:
        return 3

    @functools.wraps(test)
    def wrapped():
        return test()

    assert virtual_time(wrapped)() == 3


def test_task_of_a_virtual_test_has_its_name():
    @virtual_time
    async def names_itself() -> str:
        task = asyncio.current_task()
        return task.get_name() if task else ""

    assert names_itself() == "names_itself"


def test_ctrl_c_cancels_the_test(limits):
    limits(grace=inf)  # after which it is interrupted
    ended: list[str] = []
    cancelled = threading.Event()

    @virtual_time(thread_s=3600)
    async def waits() -> None:
        signal.raise_signal(signal.SIGINT)
        try:
            await asyncio.to_thread(cancelled.wait, 30)
        except asyncio.CancelledError:
            ended.append("cancelled")
        finally:
            cancelled.set()

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            waits()
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended == ["cancelled"]


def test_harness_in_a_plain_test_explains_the_form(golden):
    with golden.raises(NotRunning):
        harness(Nothing)


@virtual_time
async def test_harness_entered_without_async_explains_it():
    lab = harness(Nothing)
    text = r"takes an async with: write @virtual_time, .*async with harness\(…\) as lab"
    with pytest.raises(NotRunning, match=text), lab:  # type: ignore[attr-defined]  # that is the mistake
        pass
