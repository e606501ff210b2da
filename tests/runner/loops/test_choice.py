"""uvloop in a run keeps the time and ends as busflow's own event loop does; who cannot have it is told why."""

import asyncio
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor

import pytest

import busflow
from busflow import LaunchError, Node
from busflow.runner.loops.choice import chosen_loop
from busflow.runner.loops.system import new_event_loop
from tests.extras import require_extra


@pytest.fixture
def new_uvloop():
    require_extra("uvloop")
    return chosen_loop("uvloop")


def test_default_loop_is_busflow_s_own():
    assert chosen_loop("busflow") is chosen_loop("busflow", simulated=True) is new_event_loop


@pytest.mark.parametrize(
    ("name", "options", "text"),
    [
        ("uvlop", {}, "error: there is no event loop uvlop\n  fix: did you mean 'uvloop'?"),
        ("uvloop", {"simulated": True}, "error: simulated time has an event loop of its own, and cannot have uvloop"),
    ],
)
def test_unusable_loop_name_is_refused_with_a_fix(name, options, text):
    with pytest.raises(LaunchError) as refused:
        chosen_loop(name, **options)
    assert str(refused.value).startswith(text)


def test_missing_uvloop_names_how_to_install_it(monkeypatch, golden):
    monkeypatch.setitem(sys.modules, "uvloop", None)
    with golden.raises(LaunchError) as refused:
        busflow.run(Node(name="node"), event_loop="uvloop")
    assert refused.value.exit_code == 2


def test_late_deadline_counts_from_when_it_is_set(new_uvloop):
    """Whoever sets one computes it from the clock, not from when the turn began."""

    async def main():
        loop = asyncio.get_running_loop()
        await asyncio.sleep(0)
        began = time.monotonic()
        while time.monotonic() < began + 0.005:
            pass
        return time.monotonic(), loop.time(), time.monotonic()

    with asyncio.Runner(loop_factory=new_uvloop) as runner:
        before, now, after = runner.run(main())
    assert before <= now <= after


def test_thread_calls_do_not_keep_loop_from_ending(new_uvloop):
    begun, released, called = threading.Event(), threading.Event(), list[str]()
    pool = ThreadPoolExecutor(1)

    def hold():
        begun.set()
        released.wait(60)

    async def main():
        loop = asyncio.get_running_loop()
        loop.set_default_executor(pool)
        holding = loop.run_in_executor(None, hold)
        loop.run_in_executor(None, called.append, "too late")
        begun.wait(60)
        return holding

    try:
        with asyncio.Runner(loop_factory=new_uvloop) as runner:
            runner.run(main())
        assert not released.is_set()
    finally:
        released.set()
        pool.shutdown()
    assert called == []


def test_waking_a_closed_uvloop_raises(new_uvloop):
    loop = new_uvloop()
    loop.close()
    with pytest.raises(RuntimeError, match="closed"):
        loop.call_soon_threadsafe(print)
