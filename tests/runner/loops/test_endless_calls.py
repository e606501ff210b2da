"""A call in a worker thread that never ends is named, and the loop ends."""

import asyncio
import ctypes
import threading

import anyio.to_thread
import pytest

from busflow.errors import Deadlock
from busflow.testing import virtual_time


async def _in_executor(function, argument):
    return await asyncio.get_running_loop().run_in_executor(None, function, argument)


WAYS = {"anyio": anyio.to_thread.run_sync, "run_in_executor": _in_executor, "asyncio": asyncio.to_thread}


def _read_for_ever(ended):
    ended.wait(60)


@pytest.mark.parametrize("start", WAYS.values(), ids=WAYS)
def test_an_endless_thread_is_named_with_line(start):
    ended, before = threading.Event(), set(threading.enumerate())

    @virtual_time(thread_s=0.1)
    async def read():
        await start(_read_for_ever, ended)

    try:
        with pytest.raises(Deadlock, match=r"_read_for_ever at .*test_endless_calls.py:\d+: ended.wait\(60\)"):
            read()
    finally:
        ended.set()
        for thread in set(threading.enumerate()) - before:
            thread.join(60)


def _work(seconds):
    threading.Event().wait(seconds)


@pytest.mark.parametrize("start", WAYS.values(), ids=WAYS)
def test_many_short_calls_are_no_endless_one(start):
    @virtual_time(thread_s=0.5)
    async def work():
        for _ in range(10):
            await start(_work, 0.06)

    work()


def _pause():
    threading.Event().wait(0.5)  # until it was seen at work
    ctypes.PyDLL(None).usleep(800_000)
    threading.Event().wait(0.01)


@virtual_time(thread_s=0.8)
async def test_pause_of_the_process_is_no_endless_call():
    """As after Ctrl-Z, or while the machine is suspended; here the call holds the interpreter's lock."""
    await anyio.to_thread.run_sync(_pause)


@pytest.mark.parametrize("way", ["anyio", "to_thread", "executor"])
def test_a_function_without_a_frame_is_named(way):
    """Not Python code: a driver's `read`, `time.sleep`; here a lock that is held."""
    held = threading.Lock()
    held.acquire()

    @virtual_time(thread_s=0.2)
    async def waits() -> None:
        if way == "anyio":
            await anyio.to_thread.run_sync(held.acquire, abandon_on_cancel=True)
        elif way == "to_thread":
            await asyncio.to_thread(held.acquire)
        else:
            await asyncio.get_running_loop().run_in_executor(None, held.acquire)

    try:
        with pytest.raises(Deadlock) as found:
            waits()
    finally:
        held.release()
    assert "acquire" in str(found.value).partition("\n")[0]
    assert "await " in str(found.value)  # the line from which it was called
