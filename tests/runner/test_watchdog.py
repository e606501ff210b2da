"""The watchdog names who keeps the event loop from turning, and costs those nothing who do not."""

import asyncio
import threading

import pytest

from busflow import Graph, Message, Node, on_event, publisher, subscription, timer
from busflow.bus.events import SubscriptionMatched
from busflow.clock import SimClock, perf_counter
from busflow.errors import ExitCode
from busflow.runner import watchdog
from busflow.testing import virtual_time

BOUND_S = 0.05


class Number(Message, package="test"):
    data: int = 0


def block(logged):
    """Keep the thread busy in Python, as a handler that computes does, until that event is set."""
    end = perf_counter() + 60
    while not logged.is_set() and perf_counter() < end:
        pass


class Blocking(Node):
    """Blocks once in one of its methods."""

    numbers = publisher(Number, "numbers")

    def in_(self, where):
        self.where, self.logged = where, threading.Event()
        return self

    def work(self, here):
        if self.where == here:
            self.where = "nowhere"
            block(self.logged)

    async def run(self):
        await asyncio.sleep(0.01)
        self.work("run")
        self.spawn(self.task(), name="more")

    async def task(self):
        self.work("task")

    @timer(0.01)
    def tick(self):
        self.work("timer")
        self.numbers.publish(Number())

    @timer(0.01)
    async def slowly(self):
        self.work("async timer")

    @subscription("numbers")
    def on_number(self, _number: Number):
        self.work("handler")

    @subscription("numbers")
    async def on_number_slowly(self, _number: Number):
        self.work("async handler")

    @on_event("numbers")
    def matched(self, _event: SubscriptionMatched):
        self.work("event")


HANDLERS = {
    "run": "Blocking.run",
    "task": "task more",
    "timer": "timer tick",
    "async timer": "timer slowly",
    "handler": "Blocking.on_number",
    "async handler": "Blocking.on_number_slowly",
}


@pytest.mark.parametrize("where", HANDLERS)
def test_blocking_handler_is_named_with_its_stack(where, golden):
    async def main():
        log, logged = [], asyncio.Event()
        loop, handler = asyncio.get_running_loop(), HANDLERS[where]

        def sink(record):  # on the watchdog's thread
            if record.values.get("handler") == handler:
                log.append(record)
                blocking.logged.set()
                loop.call_soon_threadsafe(logged.set)

        blocking = Blocking().in_(where)
        graph = Graph([blocking], watchdog_s=BOUND_S, sinks=(sink,))
        async with graph, asyncio.timeout(60):
            await logged.wait()
        return log, graph.report()

    [line], report = asyncio.run(main())
    assert (line.node, line.level) == ("/blocking", "warning")
    golden(line.event)
    assert "in block < " in line.values["stack"]
    assert "in work" in line.values["stack"]
    [block] = [block for block in report.blocks if block.handler == HANDLERS[where]]
    assert (block.node, block.count) == ("/blocking", 1)
    assert {"node", "handler", "count", "longest_s"} == set(report.as_json()["blocks"][0])


def test_blocking_node_stops_before_those_launched_later(monkeypatch):
    monkeypatch.setattr(watchdog, "_JUST_NOW_S", 60)
    states = []

    class Late(Node):
        async def stop(self):
            states.extend(node.state for node in graph.report().nodes)

    def sink(record):  # on the watchdog's thread
        if record.values.get("handler"):
            graph.course.ask_to_stop_from_thread(ExitCode.TERMINATED)
            blocking.logged.set()

    async def main():
        async with graph, asyncio.timeout(60):
            await graph.wait()

    blocking = Blocking().in_("timer")
    graph = Graph([blocking, Late], watchdog_s=BOUND_S, sinks=(sink,))
    asyncio.run(main())
    assert states[0] in {"stopping", "stopped"}


def test_watchdog_runs_only_on_request_until_the_end():
    def watching():
        return {thread for thread in threading.enumerate() if thread.name == "busflow.watchdog"}

    async def main():
        earlier = watching()
        async with Graph([Blocking().in_("nowhere")]):
            assert watching() <= earlier
        async with Graph([Blocking().in_("nowhere")], watchdog_s=BOUND_S):
            [thread] = watching() - earlier
        thread.join(timeout=60)
        assert not thread.is_alive()

    asyncio.run(main())


@virtual_time
async def test_virtual_time_has_no_watchdog():
    assert Graph([Blocking().in_("nowhere")], clock=SimClock(), watchdog_s=BOUND_S).watchdog is None
