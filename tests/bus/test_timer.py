"""Tests of `timer.py`: an exact grid that never drifts, and a count of every missed tick."""

import asyncio
from fractions import Fraction

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from busflow.bus.bus import Bus
from busflow.bus.timer import LATENESS_KEPT, Missed, Timer
from busflow.clock import Clock, Duration, Time
from busflow.errors import InvalidDeclaration
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time
from tests.vectors import each_case


class HandClock(Clock):
    """A clock that a test sets, as if the loop had been held up; it keeps what it was asked to call."""

    kind = "system"

    def __init__(self, now_ns=0):
        self.now_ns = now_ns
        self.due_ns, self.callback = None, None
        super().__init__()

    def now(self):
        return Time(self.now_ns)

    def monotonic_ns(self):
        return self.now_ns

    def call_at(self, deadline_ns, callback):
        self.due_ns, self.callback = deadline_ns, callback
        return asyncio.get_running_loop().call_later(1e9, callback)

    def pass_until(self, now_ns):
        """Let the loop come back at this time, and call what is due then, once for each time it asks."""
        self.now_ns = now_ns
        while self.due_ns <= now_ns:
            self.callback()


class Ticking:
    """A timer on a bus, without a node."""

    def __init__(self, bench, period_s, handler, **options):
        self.failures, self.tasks = [], []
        self.timer = Timer(period_s, handler, name="tick", node="/node", **options)
        bench.attach_timer(self.timer, self.spawn, self.failures.append)
        self.timer.open()

    def spawn(self, coroutine, name):
        self.tasks.append(asyncio.create_task(coroutine, name=name))


class Counter:
    """A handler that notes when it is called."""

    def __init__(self):
        self.times = []

    def __call__(self):
        self.times.append(asyncio.get_running_loop().time_ns())


def milliseconds(counter):
    return [round(time / 1_000_000) for time in counter.times]


@each_case("d_timer_simtime", "zero_callback/", "number_callbacks/", "cancel_reset/")
@virtual_time
async def test_how_often_a_timer_calls(make_bench, case):
    counter, since = Counter(), 0
    for step, *operands in case["steps"]:
        match step:
            case "create":
                period_s = operands[0]["period_s"]
                timer = Ticking(make_bench().bus, period_s, counter).timer
            case "spin_for_periods":
                await asyncio.sleep(operands[0] * period_s)
            case "expect_calls":
                assert len(counter.times) == operands[0]
                since = len(counter.times)
            case "expect_calls_since":
                assert len(counter.times) - since == operands[0]
                since = len(counter.times)
            case "cancel":
                timer.cancel()
            case "reset":
                timer.reset()
            case _:
                assert step == "expect_canceled"


@each_case("d_timer_simtime", "rcl/realign")
@virtual_time
async def test_next_tick_after_a_late_one(case):
    now, due, period = (case["input"][f"{name}_ns"] for name in ("now", "next_call", "period"))
    clock = HandClock(due - period)
    ticking = Ticking(Bus(clock), Fraction(period, 10**9), lambda: None)
    assert clock.due_ns == due
    clock.now_ns = now
    clock.callback()
    assert clock.due_ns == case["expect"]["next_call_ns"]
    assert (ticking.timer.fired, ticking.timer.missed) == (1, max(0, now - due) // period)


@each_case("d_timer_simtime", "rcl/canceled_not_ready")
@virtual_time
async def test_cancelled_timer_does_not_tick(make_bench, case):
    counter = Counter()
    timer = Ticking(make_bench().bus, Fraction(case["steps"][0][1]["period_ns"], 10**9), counter).timer
    timer.cancel()
    await asyncio.sleep(10)
    assert counter.times == []


@each_case("d_timer_simtime", "rcl/get_period")
def test_a_timer_says_its_period(case, golden):
    timer = Timer(Fraction(case["steps"][0][1]["period_ns"], 10**9), lambda: None, name="tick", node="/node")
    assert timer.period_s * 1e9 == case["steps"][1][1]
    golden(repr(timer))


@pytest.mark.parametrize("period_s", [-1e-9, -1, float("nan"), float("inf"), True, None, "soon", 1e-10])
def test_invalid_period_is_refused_with_its_value(period_s):
    """Case rcl/init_invalid."""
    with pytest.raises(InvalidDeclaration) as caught:
        Timer(period_s, lambda: None, name="tick", node="/node")
    assert "timer tick" in str(caught.value)
    assert repr(period_s) in str(caught.value)


# The grid.


@given(st.one_of(st.fractions(Fraction(1, 10**6), 100), st.floats(1e-6, 100)), st.integers(0, 10**18))
@example(Fraction(1, 3), 0)
@example(0.1, 7)
def test_tick_is_due_at_the_nearest_nanosecond(period_s, start_ns):
    exact = Fraction(str(period_s)) * 10**9

    @virtual_time
    async def main():
        clock = HandClock(start_ns)
        ticking = Ticking(Bus(clock), period_s, lambda: None)
        for tick in range(1, 50):
            assert abs(clock.due_ns - start_ns - tick * exact) <= Fraction(1, 2)
            clock.pass_until(clock.due_ns)
        assert (ticking.timer.fired, ticking.timer.missed) == (49, 0)

    main()


@virtual_time
async def test_first_tick_comes_after_one_period(make_bench):
    bench, on, off = make_bench(), Counter(), Counter()
    Ticking(bench.bus, 0.5, on)
    timer = Ticking(bench.bus, 0, off).timer
    timer.reset()
    await asyncio.sleep(1.2)
    assert milliseconds(on) == [500, 1000]
    assert off.times == []


@virtual_time
async def test_new_period_counts_from_its_setting(make_bench):
    counter = Counter()
    timer = Ticking(make_bench().bus, 1, counter).timer
    await asyncio.sleep(1.5)
    timer.period_s = 0.2
    await asyncio.sleep(0.5)
    timer.period_s = 0
    await asyncio.sleep(10)
    timer.period_s = 0.3
    await asyncio.sleep(0.4)
    assert milliseconds(counter) == [1000, 1700, 1900, 12300]
    with pytest.raises(InvalidDeclaration):
        timer.period_s = -1
    assert timer.period_s == 0.3


@virtual_time
async def test_handler_may_change_its_own_timer(make_bench):
    times = []

    def handle():
        times.append(round(asyncio.get_running_loop().time(), 3))
        if len(times) == 2:
            timer.period_s = 0.1
        if len(times) == 4:
            timer.reset()
        if len(times) == 5:
            timer.cancel()

    timer = Ticking(make_bench().bus, 1, handle).timer
    await asyncio.sleep(10)
    assert times == [1, 2, 2.1, 2.2, 2.3]


@virtual_time
async def test_a_closed_timer_ticks_no_more_for_good(make_bench):
    counter = Counter()
    timer = Ticking(make_bench().bus, 1, counter).timer
    timer.close()
    timer.reset()
    timer.period_s = 0.1
    await asyncio.sleep(10)
    assert counter.times == []


@virtual_time
async def test_calling_a_timer_keeps_its_grid(make_bench):
    counter = Counter()
    timer = Ticking(make_bench().bus, 1, counter).timer
    await asyncio.sleep(0.5)
    timer()
    timer.reset()
    timer()
    await asyncio.sleep(1)
    assert milliseconds(counter) == [500, 500, 1500]
    assert timer.fired == 1


# Ticks that could not be kept.


@virtual_time
async def test_ticks_missed_by_the_loop_are_skipped():
    """Case rcl/overrun."""
    clock, called = HandClock(), []
    timer = Ticking(Bus(clock), Fraction(200, 1000), lambda: called.append(clock.now_ns)).timer
    clock.pass_until(500_000_000)
    clock.pass_until(510_000_000)
    clock.pass_until(600_000_000)
    assert called == [500_000_000, 600_000_000]
    assert (timer.fired, timer.missed) == (2, 1)
    assert timer.statistics().lateness_p99_s == 0.1


@virtual_time
async def test_burst_calls_ticks_missed_by_the_loop():
    clock, called = HandClock(), []
    timer = Ticking(Bus(clock), 0.2, lambda: called.append(clock.now_ns), missed=Missed.BURST).timer
    clock.pass_until(700_000_000)
    clock.pass_until(800_000_000)
    assert called == [700_000_000] * 3 + [800_000_000]
    assert (timer.fired, timer.missed) == (4, 0)


@virtual_time
async def test_ticks_during_an_async_handler_are_skipped(make_bench):
    counter = Counter()

    async def handle():
        counter()
        await asyncio.sleep(2.5)

    timer = Ticking(make_bench().bus, 1, handle).timer
    await asyncio.sleep(7.5)
    assert milliseconds(counter) == [1000, 4000, 7000]
    assert (timer.fired, timer.missed) == (3, 4)


@virtual_time
async def test_burst_calls_ticks_missed_during_a_handler(make_bench):
    counter = Counter()

    async def handle():
        counter()
        await asyncio.sleep(2.5 if len(counter.times) == 1 else 0.1)

    timer = Ticking(make_bench().bus, 1, handle, missed=Missed.BURST).timer
    await asyncio.sleep(5.5)
    assert milliseconds(counter) == [1000, 3500, 3600, 4000, 5000]
    assert (timer.fired, timer.missed) == (5, 0)


@pytest.mark.parametrize("ending", ["cancel", "close", "reset"])
@virtual_time
async def test_reset_discards_owed_ticks(make_bench, ending):
    """Case rcl/reset; calling before the reset moves nothing."""
    counter = Counter()

    async def handle():
        counter()
        await asyncio.sleep(3.5)

    timer = Ticking(make_bench().bus, 1, handle, missed=Missed.BURST).timer
    await asyncio.sleep(4.2)
    getattr(timer, ending)()
    await asyncio.sleep(0.9)
    assert milliseconds(counter) == [1000]


# What is reported.


@virtual_time
async def test_lateness_is_the_nearest_rank_percentile():
    clock = HandClock()
    timer = Ticking(Bus(clock), 1, lambda: None).timer
    assert (timer.statistics().lateness_p50_s, timer.statistics().lateness_p99_s) == (None, None)
    for _ in range(100):
        clock.pass_until(clock.due_ns + 900_000_000)
    for late_ms in range(1, LATENESS_KEPT + 1):
        clock.pass_until(clock.due_ns + late_ms * 100_000)
    statistics = timer.statistics()
    assert (statistics.lateness_p50_s, statistics.lateness_p99_s) == (0.2048, 0.4056)
    assert (statistics.node, statistics.name, statistics.period_s) == ("/node", "tick", 1.0)
    assert (statistics.fired, statistics.missed) == (LATENESS_KEPT + 100, 0)


@virtual_time
async def test_message_from_a_tick_is_delivered_at_once(make_bench):
    bench, received = make_bench(), []
    publisher = bench.publisher()
    bench.subscription(received.append)

    def handle():
        asyncio.get_running_loop().call_soon(lambda: seen_by_the_next.append(len(received)))
        publisher.publish(Int64(data=1))

    seen_by_the_next = []
    Ticking(bench.bus, 1, handle)
    await asyncio.sleep(1.1)
    assert seen_by_the_next == [1]


@virtual_time
async def test_observer_is_called_before_every_tick(make_bench):
    for kind in ("plain", "async"):
        log = []

        def plain(log=log):
            log.append("called")

        async def waiting(log=log):
            log.append("called")

        timer = Timer(1, plain if kind == "plain" else waiting, name="tick", node="/node")
        timer.observe(lambda log=log: log.append("observed"))
        make_bench().bus.attach_timer(timer, lambda coroutine, name: asyncio.create_task(coroutine, name=name), print)
        timer.open()
        await asyncio.sleep(2.5)
        timer.close()
        assert log == ["observed", "called"] * 2


# Failing.


@pytest.mark.parametrize(
    "error",
    [ValueError("no"), SystemExit(3), KeyboardInterrupt(), asyncio.CancelledError()],
    ids=lambda error: type(error).__name__,
)
@pytest.mark.parametrize("kind", ["plain", "async"])
@virtual_time
async def test_failed_handler_is_reported_once_and_stopped(make_bench, kind, error):
    calls = []

    def fail():
        calls.append(1)
        if len(calls) == 2:
            raise error

    async def fail_later():
        await asyncio.sleep(0.1)
        fail()

    ticking = Ticking(make_bench().bus, 1, fail if kind == "plain" else fail_later)
    await asyncio.sleep(10)
    assert ticking.failures == [error]
    assert len(calls) == 2


@virtual_time
async def test_handler_cancelled_from_outside_has_not_failed(make_bench):
    async def handle():
        await asyncio.Event().wait()

    ticking = Ticking(make_bench().bus, 1, handle)
    await asyncio.sleep(1.5)
    [task] = ticking.tasks
    task.cancel()
    await asyncio.sleep(1)
    assert task.cancelled()
    assert ticking.failures == []
    assert ticking.timer.fired == 2


@virtual_time
async def test_plain_handler_returning_a_coroutine_fails(make_bench, golden):
    async def work():
        raise AssertionError("nobody awaits this")

    def handle():
        return work()

    ticking = Ticking(make_bench().bus, 1, handle)
    await asyncio.sleep(5)
    [error] = ticking.failures
    assert isinstance(error, InvalidDeclaration)
    golden(str(error))


@virtual_time
async def test_grid_follows_a_jump_back_of_time():
    clock = HandClock()
    ticking = Ticking(Bus(clock), 1, lambda: None)

    def jump_back(milliseconds):
        for listener in clock.on_jump:
            listener(Duration(-milliseconds * 1_000_000))
        return clock.due_ns // 1_000_000

    clock.now_ns = 400_000_000
    assert jump_back(300) == 1300, "the tick keeps its stamp"
    assert jump_back(500) == 1400, "time is before the last tick: a new grid"
    ticking.timer.cancel()
    clock.now_ns = 500_000_000
    assert jump_back(500) == 1400, "a cancelled timer stays cancelled"
