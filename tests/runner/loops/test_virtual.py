"""Virtual time: everything that waits is virtual, the order is kept, threads hold time still, deadlock is told."""

import asyncio
import inspect
import itertools
import json
import math
import os
import random
import signal
import socket
import subprocess
import sys
import threading

import anyio
import anyio.from_thread
import anyio.lowlevel
import anyio.to_thread
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.clock import SIM_EPOCH_NS, SimClock, Time
from busflow.errors import BusflowError, Deadlock
from busflow.testing import virtual_time


def now_ns():
    return asyncio.get_running_loop().time_ns()


def settle():
    return asyncio.get_running_loop().settle()


def run(main, **options):
    return virtual_time(**options)(main)()


# What waits, waits in virtual time


async def _asyncio_timeout():
    with pytest.raises(TimeoutError):
        async with asyncio.timeout(3600):
            await asyncio.Event().wait()


async def _asyncio_wait_for():
    with pytest.raises(TimeoutError):
        await asyncio.wait_for(asyncio.Event().wait(), 3600)


async def _asyncio_wait():
    task = asyncio.create_task(asyncio.Event().wait())
    done, _ = await asyncio.wait([task], timeout=3600)
    assert not done
    task.cancel()


async def _move_on_after():
    with anyio.move_on_after(3600) as scope:
        await anyio.sleep_forever()
    assert scope.cancelled_caught


async def _fail_after():
    with pytest.raises(TimeoutError):
        with anyio.fail_after(3600):
            await anyio.Event().wait()


async def _sleep_until():
    await anyio.sleep_until(anyio.current_time() + 3600)


async def _call_later():
    done = asyncio.Event()
    asyncio.get_running_loop().call_later(3600, done.set)
    await done.wait()


async def _call_at():
    loop, done = asyncio.get_running_loop(), asyncio.Event()
    loop.call_at(loop.time() + 3600, done.set)
    await done.wait()


WAITS = {
    "asyncio.sleep": lambda: asyncio.sleep(3600),
    "anyio.sleep": lambda: anyio.sleep(3600),
    "clock.sleep": lambda: SimClock().sleep(3600),
    "clock.sleep_until": lambda: SimClock().sleep_until(Time(SIM_EPOCH_NS + 3600 * 10**9)),
    "anyio.sleep_until": _sleep_until,
    "asyncio.timeout": _asyncio_timeout,
    "asyncio.wait_for": _asyncio_wait_for,
    "asyncio.wait": _asyncio_wait,
    "anyio.move_on_after": _move_on_after,
    "anyio.fail_after": _fail_after,
    "loop.call_later": _call_later,
    "loop.call_at": _call_at,
}


@pytest.mark.parametrize("seed", [None, 1])
@pytest.mark.parametrize("wait", WAITS.values(), ids=WAITS)
def test_an_hour_passes_at_once_and_exactly(wait, seed):
    async def main():
        await wait()
        return now_ns()

    assert run(main, seed=seed) == 3600 * 10**9


@virtual_time
async def test_sleeping_adds_up_without_error():
    for _ in range(10_000):
        await asyncio.sleep(0.1)
    assert now_ns() == 1000 * 10**9
    for _ in range(1000):
        await asyncio.sleep(1.001)  # a float that lies just below
    assert now_ns() == 2001 * 10**9


@virtual_time
async def test_fractional_nanosecond_deadline_fires_once_with_its_equals():
    """0.1 + 0.2 is not 0.3 in floats; anyio asks for its deadline again when it is called too early."""
    order = []
    await asyncio.sleep(0.1)

    async def watch():
        with anyio.move_on_after(0.2):
            await anyio.sleep_forever()
        order.append(("watch", now_ns()))

    async def sleep():
        await asyncio.sleep(0.2)
        order.append(("sleep", now_ns()))

    await asyncio.gather(watch(), sleep())
    assert order == [("watch", 300_000_000), ("sleep", 300_000_000)]


@virtual_time
async def test_time_stays_exact_after_most_of_a_day():
    clock = SimClock()
    await clock.sleep(86_400 * 0.9)
    fired = []
    due = clock.monotonic_ns() + 1
    clock.call_at(due, lambda: fired.append(clock.monotonic_ns()))
    clock.call_at(due + 1, lambda: fired.append(clock.monotonic_ns()))
    await clock.sleep(1e-6)
    assert fired == [due, due + 1]


@virtual_time
async def test_simulated_clock_starts_at_its_epoch():
    await asyncio.sleep(5)
    clock = SimClock()
    assert (clock.seconds(), clock.kind, clock.monotonic_ns()) == (0.0, "sim", 5 * 10**9)
    await clock.sleep(1.5)
    assert clock.seconds() == 1.5
    assert clock.now() == Time(SIM_EPOCH_NS + 6_500_000_000)
    assert SimClock(epoch_ns=7).now().nanoseconds == 6_500_000_007


@pytest.mark.parametrize("seconds", [0, -1, -math.inf])
def test_sleeping_for_nothing_moves_no_time(seconds):
    async def main():
        await SimClock().sleep(seconds)
        asyncio.get_running_loop().call_later(seconds, lambda: None)
        await settle()
        return now_ns()

    assert run(main) == 0


def test_waiting_for_nan_seconds_is_refused():
    async def main():
        with pytest.raises(ValueError, match="NaN"):
            asyncio.get_running_loop().call_later(math.nan, lambda: None)

    run(main)


# Order


@virtual_time
async def test_equal_deadlines_keep_their_order():
    """A heap alone does not: asyncio fires twelve timers of one deadline as 0, 2, 6, 5, 11 …"""
    loop, fired = asyncio.get_running_loop(), []
    for number in range(100):
        loop.call_later(1, fired.append, number)
    await asyncio.sleep(1)
    assert fired == list(range(100))


delays = st.lists(st.integers(0, 5), max_size=40)


@given(delays, st.data())
def test_timers_fire_by_deadline_then_by_age(delays, data):
    cancelled = data.draw(st.sets(st.integers(0, max(0, len(delays) - 1))))

    async def main():
        loop, fired = asyncio.get_running_loop(), []
        handles = [loop.call_later(delay, fired.append, number) for number, delay in enumerate(delays)]
        for number in cancelled & set(range(len(delays))):
            handles[number].cancel()
        await asyncio.sleep(6)
        return fired

    assert run(main) == [
        number for _, number in sorted(zip(delays, itertools.count(), strict=False)) if number not in cancelled
    ]


@virtual_time
async def test_cancelled_timeouts_do_not_pile_up():
    loop = asyncio.get_running_loop()
    for _ in range(10_000):
        async with asyncio.timeout(3600):
            await asyncio.sleep(0.001)
    assert len(loop._timers) < 500


async def _who_is_first():
    """Five tasks that start at once, wait for one event and sleep once; callbacks in between."""
    order, go = [], asyncio.Event()
    loop = asyncio.get_running_loop()

    async def task(name):
        order.append(name)
        await go.wait()
        order.append(name)
        await asyncio.sleep(1)
        order.append(name)

    async with asyncio.TaskGroup() as group:
        for name in "abcde":
            group.create_task(task(name))
        await asyncio.sleep(0.5)
        for number in range(5):
            loop.call_soon(order.append, number)
        go.set()
    return order


def test_without_a_seed_the_order_is_asyncios():
    order = run(_who_is_first)
    assert order == [*"abcde", *range(5), *"abcde", *"abcde"]


def test_each_seed_is_one_order_of_tasks():
    orders = {seed: run(_who_is_first, seed=seed) for seed in range(30)}
    assert orders == {seed: run(_who_is_first, seed=seed) for seed in range(30)}
    assert len({tuple(order) for order in orders.values()}) > 20


@pytest.mark.parametrize("seed", range(20))
def test_under_a_seed_callbacks_keep_their_order(seed):
    """Transports rely on it; only task steps may overtake."""
    order = run(_who_is_first, seed=seed)
    assert [each for each in order if isinstance(each, int)] == [0, 1, 2, 3, 4]
    assert sorted(map(str, order)) == sorted([*"01234", *"abcde" * 3])


LOST_UPDATE = """
import asyncio, json
from busflow.testing import virtual_time

async def main():
    total = 0
    async def add():
        nonlocal total
        for _ in range(3):
            seen = total
            await asyncio.sleep(0)
            total = seen + 1
    async def other():
        for _ in range(4):
            await asyncio.sleep(0)
    await asyncio.gather(other(), add(), other(), add())
    return total

print(json.dumps([virtual_time(seed=seed)(main)() for seed in range(60)]))
"""


def test_seed_gives_same_order_in_every_process():
    outputs = {
        subprocess.run(
            [sys.executable, "-c", LOST_UPDATE], env={"PYTHONHASHSEED": hash_seed}, capture_output=True, text=True
        ).stdout
        for hash_seed in ("0", "1", "random")
    }
    assert len(outputs) == 1
    assert len(set(json.loads(outputs.pop()))) > 1


# Settling


@virtual_time
async def test_settle_runs_only_what_is_due_now():
    loop, ran = asyncio.get_running_loop(), []

    async def chain(length):
        for _ in range(length):
            await asyncio.sleep(0)
        ran.append("chain")

    task = asyncio.create_task(chain(50))
    loop.call_later(0, lambda: loop.call_soon(ran.append, "due"))
    loop.call_at(loop.time(), ran.append, "now")
    loop.call_later(1e-9, ran.append, "later")
    await settle()
    assert sorted(ran) == ["chain", "due", "now"]
    assert now_ns() == 0
    await task


@virtual_time
async def test_several_can_settle_and_one_may_be_cancelled():
    settled = []

    async def one(name):
        await settle()
        settled.append(name)

    tasks = [asyncio.create_task(one(name)) for name in "abc"]
    await asyncio.sleep(0)
    tasks[1].cancel()
    await settle()
    assert settled == ["a", "c"]


# Threads


def _work(wait):
    """Real work in a thread: it ends when a second thread lets it, some milliseconds later."""
    done = threading.Event()
    threading.Timer(0.03, done.set).start()
    done.wait()
    wait.append("worked")
    return threading.current_thread().name


async def _in_executor(fn, argument):
    return await asyncio.get_running_loop().run_in_executor(None, fn, argument)


THREADS = {
    "anyio.to_thread": anyio.to_thread.run_sync,
    "anyio.to_thread, a limiter of one's own": lambda fn, arg: anyio.to_thread.run_sync(
        fn, arg, limiter=anyio.CapacityLimiter(1)
    ),
    "run_in_executor": _in_executor,
    "asyncio.to_thread": asyncio.to_thread,
}


@pytest.mark.parametrize("start", THREADS.values(), ids=THREADS)
def test_time_stands_still_while_a_thread_works(start):
    async def main():
        worked = []
        with anyio.fail_after(0.001):
            assert await start(_work, worked) != threading.main_thread().name
        assert (worked, now_ns()) == (["worked"], 0)
        async with anyio.create_task_group() as group:
            group.start_soon(start, _work, worked)
            group.start_soon(start, _work, worked)
            await settle()
            assert len(worked) == 3
        await anyio.sleep(1)
        return now_ns()

    assert run(main) == 10**9


@pytest.mark.parametrize("start", THREADS.values(), ids=THREADS)
def test_an_idle_worker_holds_nothing(start):
    async def main():
        await start(len, "")
        await asyncio.sleep(3600)
        return now_ns()

    assert run(main) == 3600 * 10**9


@virtual_time
async def test_a_worker_can_call_back_into_the_loop():
    async def double(number):
        await anyio.lowlevel.checkpoint()
        return 2 * number

    assert await anyio.to_thread.run_sync(anyio.from_thread.run, double, 4) == 8


@virtual_time
async def test_time_moves_for_a_waiting_worker():
    """It would be a deadlock otherwise: the worker waits for the loop, the loop for the worker."""
    await anyio.to_thread.run_sync(anyio.from_thread.run, anyio.sleep, 2)
    assert now_ns() == 2 * 10**9


@virtual_time
async def test_another_thread_can_wake_the_loop(limits):
    """A thread that nobody awaits: time does not wait for it, but nothing is a deadlock while it lives."""
    limits(foreign_threads=math.inf)
    loop, event = asyncio.get_running_loop(), asyncio.Event()
    threading.Timer(0.005, loop.call_soon_threadsafe, [event.set]).start()
    await event.wait()
    assert now_ns() == 0


def test_loop_end_waits_for_the_executor(recwarn, limits):
    """Its thread is joined in a thread of asyncio's own, under a timeout that must not be virtual."""
    limits(foreign_threads=0)

    async def main():
        worked = []
        future = asyncio.get_running_loop().run_in_executor(None, _work, worked)
        future.cancel()
        return worked

    assert run(main) == ["worked"]
    assert not [warning for warning in recwarn if "executor" in str(warning.message)]


# Input from outside


@virtual_time
async def test_sockets_work_and_take_no_time():
    async def echo(reader, writer):
        writer.write((await reader.readline()).upper())
        writer.close()

    server = await asyncio.start_server(echo, "127.0.0.1", 0)
    reader, writer = await asyncio.open_connection(*server.sockets[0].getsockname())
    writer.write(b"hello\n")
    assert await reader.readline() == b"HELLO\n"
    writer.close()
    server.close()
    assert now_ns() == 0


def test_silent_peer_ends_as_a_deadlock(limits):
    limits(idle_sockets=0.01)

    async def main():
        ours, theirs = socket.socketpair()
        with ours, theirs:
            ours.setblocking(False)
            await asyncio.get_running_loop().sock_recv(ours, 1)

    with pytest.raises(Deadlock, match="sock_recv"):
        run(main)


@pytest.mark.skipif(not hasattr(signal, "SIGUSR1"), reason="no such signal here")
@pytest.mark.parametrize("busy", [False, True])
def test_a_signal_reaches_the_loop(busy):
    async def main():
        loop, caught = asyncio.get_running_loop(), asyncio.Event()
        loop.add_signal_handler(signal.SIGUSR1, caught.set)
        os.kill(os.getpid(), signal.SIGUSR1)
        for _ in range(500 if busy else 0):
            await asyncio.sleep(1)
        assert caught.is_set() or not busy
        await caught.wait()

    run(main, horizon_s=1000)


# Deadlock


async def _waits_for_an_event(event):
    await event.wait()


def test_deadlock_names_waiting_tasks_and_their_lines(golden):
    async def main():
        await asyncio.sleep(1.5)
        event = asyncio.Event()
        async with asyncio.TaskGroup() as group:
            one = group.create_task(_waits_for_an_event(event), name="one")
            group.create_task(asyncio.wait_for(one, None), name="two")
            group.create_task(anyio.sleep_forever(), name="three\x1b[31m")

    with pytest.raises(Deadlock) as caught:
        run(main)
    head, *lines = str(caught.value).splitlines()
    golden(head)
    names = [line.strip().split(" waits for ")[0] for line in lines]
    assert names == ["task 'main'", "task 'one'", "task 'three\\x1b[31m'", "task 'two'"]
    _, one, three, two = lines
    assert f"Event.wait in _waits_for_an_event at {__file__}:" in one
    assert one.endswith(": await event.wait()")
    assert "sleep" in three
    assert "task 'one'" in two
    assert isinstance(caught.value, BusflowError)


def test_deadlock_cancels_tasks_which_clean_up():
    cleaned = []

    async def main():
        try:
            await asyncio.Event().wait()
        finally:
            await asyncio.sleep(1)
            cleaned.append(now_ns())

    with pytest.raises(Deadlock):
        run(main)
    assert cleaned == [10**9]


def test_endless_wait_ends_at_the_horizon(golden):
    async def main():
        async def tick():
            for _ in itertools.count():
                await asyncio.sleep(0.1)

        task = asyncio.create_task(tick(), name="tick")
        await asyncio.Event().wait()
        await task

    with golden.raises(Deadlock):
        run(main, horizon_s=60)


def test_loop_that_turns_without_moving_raises(monkeypatch, golden):
    monkeypatch.setattr("busflow.runner.loops.virtual._TURNS", 1000)

    async def main():
        for _ in itertools.count():
            await asyncio.sleep(0)

    with golden.raises(Deadlock):
        run(main)


# The decorator


@virtual_time
async def test_fixtures_reach_a_decorated_test(tmp_path, request):
    assert tmp_path.is_dir()
    assert request.node.name == "test_fixtures_reach_a_decorated_test"


class TestMethods:
    @virtual_time(seed=3)
    async def test_a_method_can_be_decorated(self):
        await asyncio.sleep(1)
        assert now_ns() == 10**9


@given(st.integers(0, 10))
@virtual_time
async def test_hypothesis_comes_on_top(seconds):
    await asyncio.sleep(seconds)
    assert now_ns() == seconds * 10**9


def test_the_decorator_keeps_name_signature_and_result():
    @virtual_time
    async def answer(left: int, right: int = 2) -> int:
        """Adds."""
        return left + right

    assert (answer.__name__, answer.__doc__) == ("answer", "Adds.")
    assert list(inspect.signature(answer).parameters) == ["left", "right"]
    assert not inspect.iscoroutinefunction(answer)
    assert answer(1) == 3


def test_errors_come_out_of_a_decorated_test():
    @virtual_time
    async def fail():
        await asyncio.sleep(1)
        raise KeyError("mine")

    with pytest.raises(KeyError, match="mine"):
        fail()


def test_importing_the_package_is_cheap():
    code = "import busflow.testing, sys; print(sys.modules.keys() & {'asyncio', 'anyio', 'pydantic', 'numpy'})"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True).stdout.strip() == "set()"


@given(st.integers(0, 2**32))
def test_random_task_graphs_end_at_their_computed_time(seed):
    """A model: each task sleeps, starts others and waits for them; the end is the longest path."""
    rng = random.Random(seed)

    def plan(depth):
        return rng.randrange(5), [plan(depth - 1) for _ in range(rng.randrange(3))] if depth else []

    def longest(planned):
        return planned[0] + max((longest(child) for child in planned[1]), default=0)

    async def perform(planned):
        await anyio.sleep(planned[0])
        async with asyncio.TaskGroup() as group:
            for child in planned[1]:
                group.create_task(perform(child))

    planned = plan(4)

    async def main():
        await perform(planned)
        return now_ns()

    assert run(main) == run(main, seed=seed) == longest(planned) * 10**9
