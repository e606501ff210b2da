"""Tests of `dispatcher.py`: fair turns, bounded budgets, and delivery before an entry point returns."""

import asyncio
import itertools

import pytest

from busflow.bus.dispatcher import BUDGET_MESSAGES, BUDGET_S, QUANTUM, SLOW_S, Dispatcher
from busflow.clock import perf_counter
from busflow.runner.loops.schedule import Schedule
from busflow.testing import virtual_time


class Backlog:
    """A subscription as the dispatcher sees it: queued messages, and a log of the turns."""

    def __init__(self, dispatcher, log, name, waiting):
        self.dispatcher, self.log, self.name, self.waiting = dispatcher, log, name, waiting

    def turn(self, limit):
        handled = min(limit, self.waiting)
        self.waiting -= handled
        self.log += [self.name] * handled
        if self.waiting:
            self.dispatcher.ready.append(self)
        return handled


class Endless(Backlog):
    """One whose handler publishes to its own topic, for ever."""

    def turn(self, limit):
        self.waiting = limit + 1
        return super().turn(limit)


def opened(*, virtual=True, explore=None):
    dispatcher = Dispatcher(virtual=virtual, explore=explore)
    dispatcher.open(asyncio.get_running_loop())
    return dispatcher


@virtual_time
async def test_turns_handle_at_most_a_quantum():
    dispatcher, log = opened(), []
    for name in "abc":
        dispatcher.schedule(Backlog(dispatcher, log, name, 2 * QUANTUM - 3))
    await asyncio.get_running_loop().settle()
    first, second = QUANTUM, QUANTUM - 3
    assert "".join(log) == "a" * first + "b" * first + "c" * first + "a" * second + "b" * second + "c" * second


def test_turns_are_fair_on_wall_time_too():
    async def main():
        dispatcher, log = opened(virtual=False), []
        for name in "ab":
            dispatcher.schedule(Backlog(dispatcher, log, name, 2 * QUANTUM))
        for _ in range(100):
            await asyncio.sleep(0)
        return "".join(log)

    assert asyncio.run(main()) == ("a" * QUANTUM + "b" * QUANTUM) * 2


@virtual_time
async def test_dispatcher_yields_after_its_budget_of_messages():
    dispatcher, log = opened(), []
    for name in "abc":
        dispatcher.schedule(Endless(dispatcher, log, name, 1))
    for turn in range(1, 4):
        await asyncio.sleep(0)
        assert len(log) == turn * BUDGET_MESSAGES


def test_dispatcher_yields_after_its_budget_of_time():
    """An endless flood on real time leaves the loop alone for little more than the budget."""

    async def main():
        dispatcher, log = opened(virtual=False), []
        dispatcher.schedule(Endless(dispatcher, log, "a", 1))
        turns = 0
        while len(log) < 10_000:
            await asyncio.sleep(0)
            turns += 1
        return turns

    assert asyncio.run(main()) > 1
    assert BUDGET_S < 0.001


def test_due_timer_runs_before_the_next_dispatch():
    async def main():
        loop, dispatcher, log = asyncio.get_running_loop(), opened(virtual=False), []
        done = loop.create_future()

        class Flood(Endless):
            def turn(self, limit):
                handled = super().turn(limit)
                if len(log) == handled:  # the first turn of all: a timer becomes due within it
                    loop.call_later(0, lambda: done.set_result(len(log)))
                    end = perf_counter() + 2 * BUDGET_S
                    while perf_counter() < end:
                        pass
                return handled

        dispatcher.schedule(Flood(dispatcher, log, "a", 1))
        return await done

    assert asyncio.run(main()) == QUANTUM  # one turn


@pytest.mark.parametrize("cancelled", [False, True])
def test_due_timer_runs_before_the_next_async_batch(cancelled):
    async def main():
        loop, dispatcher, log = asyncio.get_running_loop(), opened(virtual=False), []

        async def batches():
            loop.call_later(0, log.append, "timer")
            if cancelled:
                loop.call_soon(task.cancel)
            await dispatcher.rest()
            log.append("batch")

        problems = []
        loop.set_exception_handler(lambda _loop, context: problems.append(context))
        task = loop.create_task(batches())
        await asyncio.wait([task])
        for _ in range(3):
            await asyncio.sleep(0)
        return log, problems, task.cancelled()

    assert asyncio.run(main()) == (["timer"] if cancelled else ["timer", "batch"], [], cancelled)


@virtual_time
async def test_entries_are_served_only_while_it_is_open():
    dispatcher, log, loop = Dispatcher(virtual=True), [], asyncio.get_running_loop()
    for name in ("before", "again"):
        dispatcher.schedule(Backlog(dispatcher, log, name, 1))
        await loop.settle()
        assert name not in log
        dispatcher.open(loop)
        await loop.settle()
        assert log[-1] == name
        dispatcher.schedule(Backlog(dispatcher, log, "within", 1))
        await loop.settle()
        assert log[-1] == "within"
        dispatcher.schedule(Backlog(dispatcher, log, "late", 1))
        dispatcher.close()
        await loop.settle()
        assert "late" not in log
        dispatcher.ready.clear()


@virtual_time
async def test_run_now_delivers_before_it_returns():
    dispatcher, log = opened(), []
    dispatcher.run_now(lambda: dispatcher.schedule(Backlog(dispatcher, log, "a", 3)))
    assert log == ["a", "a", "a"]


@virtual_time
async def test_run_now_delivers_even_if_it_raises():
    dispatcher, log = opened(), []

    def fail():
        dispatcher.schedule(Backlog(dispatcher, log, "a", 1))
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        dispatcher.run_now(fail)
    assert log == ["a"]
    dispatcher.schedule(Backlog(dispatcher, log, "b", 1))
    await asyncio.sleep(0)
    assert log == ["a", "b"]


@virtual_time
async def test_nested_run_now_delivers_in_the_outer_one():
    dispatcher, log = opened(), []

    def inner():
        dispatcher.schedule(Backlog(dispatcher, log, "a", 1))
        log.append("inner")

    def outer():
        dispatcher.run_now(inner)
        log.append("outer")

    dispatcher.run_now(outer)
    assert log == ["inner", "outer", "a"]


@virtual_time
async def test_run_now_does_not_overtake_the_line():
    dispatcher, log = opened(), []
    dispatcher.schedule(Backlog(dispatcher, log, "first", 1))
    dispatcher.run_now(lambda: dispatcher.schedule(Backlog(dispatcher, log, "second", 1)))
    await asyncio.get_running_loop().settle()
    assert log == ["first", "second"]


@virtual_time
async def test_run_now_on_a_closed_dispatcher_delivers_nothing():
    dispatcher, log = Dispatcher(virtual=True), []
    dispatcher.run_now(lambda: dispatcher.schedule(Backlog(dispatcher, log, "a", 1)))
    assert log == []
    dispatcher.ready.clear()
    dispatcher.run_now(lambda: None)
    dispatcher.open(asyncio.get_running_loop())
    dispatcher.schedule(Backlog(dispatcher, log, "b", 1))
    await asyncio.sleep(0)
    assert log == ["b"]


def served(seed, waiting):
    """The order in which three backlogs are served with a seed."""

    @virtual_time
    async def main():
        dispatcher, log = opened(explore=Schedule(seed)), []
        for name in "abc":
            dispatcher.schedule(Backlog(dispatcher, log, name, waiting))
        await asyncio.get_running_loop().settle()
        return "".join(log)

    return main()


def test_exploring_serves_in_every_order():
    assert {served(seed, 1) for seed in range(60)} == set(map("".join, itertools.permutations("abc")))


def test_exploration_varies_turns_and_repeats_per_seed():
    orders = {served(seed, 20) for seed in range(20)}
    assert len(orders) == 20
    assert served(3, 20) == served(3, 20)
    assert all(sorted(order) == sorted("abc" * 20) for order in orders)


@virtual_time
async def test_exploring_keeps_to_the_budget_too():
    dispatcher, log = opened(explore=Schedule()), []
    dispatcher.schedule(Endless(dispatcher, log, "a", 1))
    await asyncio.sleep(0)
    assert BUDGET_MESSAGES <= len(log) < BUDGET_MESSAGES + QUANTUM


def test_exploration_changes_the_order_of_the_line():
    @virtual_time
    async def main(seed):
        dispatcher, log = opened(explore=Schedule(seed)), []
        for name in "abc":
            dispatcher.schedule(Backlog(dispatcher, log, name, 3))
        await asyncio.sleep(0)
        return len(log)

    served_in_one_turn = {main(seed) for seed in range(40)}
    assert max(served_in_one_turn) == 9
    assert min(served_in_one_turn) < 9


@pytest.mark.parametrize(("virtual", "explore", "share"), [(True, None, BUDGET_MESSAGES), (True, Schedule(1), QUANTUM)])
def test_async_batch_is_bounded_in_messages(virtual, explore, share):
    dispatcher = Dispatcher(virtual=virtual, explore=explore)
    started = dispatcher.now()
    assert not dispatcher.spent(started, share - 1)
    assert dispatcher.spent(started, share)


def test_async_batch_is_bounded_in_time():
    dispatcher = Dispatcher()
    started = dispatcher.now()
    long_ago = started - 1
    assert not dispatcher.spent(long_ago, QUANTUM - 1)
    assert dispatcher.spent(long_ago, QUANTUM)
    assert not dispatcher.spent(started + 1, QUANTUM)


class Slow(Backlog):
    """A subscription with a handler too slow for turns of eight messages."""

    def turn(self, limit):
        until = perf_counter() + limit * SLOW_S / 4
        while perf_counter() < until:
            pass
        self.log.append(limit)
        self.dispatcher.ready.append(self)
        return 1


def test_slow_handlers_get_turns_of_one_message():
    async def main():
        dispatcher, limits = opened(virtual=False), []
        dispatcher.schedule(Slow(dispatcher, limits, "slow", 1))
        for _ in range(6):  # a turn of the dispatcher is due at the earliest in the next but one of the loop
            await asyncio.sleep(0)
        dispatcher.ready.clear()
        dispatcher.schedule(Endless(dispatcher, [], "quick", 1))
        for _ in range(10_000):  # a turn that the machine interrupts is taken for a slow one
            if dispatcher.quantum == QUANTUM:
                break
            await asyncio.sleep(0)
        return limits, dispatcher.quantum

    limits, quantum = asyncio.run(main())
    assert limits[:3] == [QUANTUM, 1, 1]
    assert quantum == QUANTUM


def test_entry_point_without_messages_leaves_nothing_scheduled():
    async def main():
        dispatcher, log = opened(virtual=False), []
        dispatcher.run_now(lambda: log.append("called"))
        assert log == ["called"]
        dispatcher.schedule(Backlog(dispatcher, log, "a", 1))
        await asyncio.sleep(0)
        return log

    assert asyncio.run(main()) == ["called", "a"]
