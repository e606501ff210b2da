"""Virtual tests: what is written without async is told at once, in one sentence."""

import asyncio
import functools

import pytest

from busflow import Node
from busflow.errors import InvalidDeclaration, NotRunning
from busflow.testing import explore, harness, virtual_time


class Nothing(Node):
    """Does nothing."""


def plain() -> None:
    """A test without async."""


@pytest.mark.parametrize("decorate", [virtual_time, virtual_time(seed=1), explore, explore(schedules=2)])
def test_plain_def_is_refused_when_decorated(decorate):
    name = "explore" if "explore" in decorate.__qualname__ else "virtual_time"
    with pytest.raises(InvalidDeclaration, match=f"^@{name} runs an async test: write async def plain"):
        decorate(plain)


def test_virtual_test_in_a_running_loop_is_refused():
    @virtual_time
    async def inner() -> None:
        """Does nothing."""

    async def outer() -> None:
        inner()

    with pytest.raises(NotRunning, match=r"^inner has an event loop of its own: call it in a plain def"):
        asyncio.run(outer())


def test_async_test_under_another_decorator_is_accepted():
    async def test() -> int:
        return 3

    @functools.wraps(test)
    def wrapped():
        return test()

    assert virtual_time(wrapped)() == 3


def test_harness_in_a_plain_test_explains_the_form():
    with pytest.raises(NotRunning, match=r"async test on virtual time: write @virtual_time, below it async def test_…"):
        harness(Nothing)


@virtual_time
async def test_harness_entered_without_async_explains_it():
    lab = harness(Nothing)
    text = r"takes an async with: write @virtual_time, .*async with harness\(…\) as lab"
    with pytest.raises(NotRunning, match=text), lab:  # type: ignore[attr-defined]  # that is the mistake
        pass
