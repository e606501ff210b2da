"""Faults of one node that others must not notice."""

import asyncio

from busflow import Graph, Message, Node, publisher, subscription, supervised, timer
from busflow.clock import SimClock
from busflow.testing import virtual_time


class Number(Message, package="test"):
    data: int = 0


class Source(Node):
    numbers = publisher(Number, "numbers")

    @timer(0.01)
    def tick(self) -> None:
        self.numbers.publish(Number(data=self.tick.fired))


class Hearing(Node):
    @subscription("numbers")
    def on_number(self, number: Number) -> None:
        received.append(number.data)


received: list[int] = []


@virtual_time
async def test_failures_lose_no_message_of_others():
    class Third(Node):
        @subscription("numbers")
        def third(self, number: Number) -> None:
            if number.data % 3 == 0:
                raise ValueError(number.data)

    received.clear()
    graph = Graph([Source, Hearing, supervised(Third, restart="on-failure")], clock=SimClock())
    async with graph:
        await asyncio.sleep(1.005)
        lines = {line.node: line for line in graph.bus.ledger()}
        assert received == list(range(1, 101))
        assert lines["/hearing"].dropped == 0
        assert lines["/third"].published == 100
        node = next(node for node in graph.report().nodes if node.name == "/third")
        assert node.failures == node.restarts == graph.log.counts["error"] >= 3


@virtual_time
async def test_endless_async_handler_blocks_no_other():
    class Stuck(Node):
        @subscription("numbers")
        async def wait(self, _number: Number) -> None:
            await asyncio.Event().wait()

    received.clear()
    graph = Graph([Source, Hearing, Stuck], clock=SimClock())
    async with graph:
        await asyncio.sleep(1.005)
        stuck = next(line for line in graph.bus.ledger() if line.node == "/stuck")
        assert (len(received), stuck.delivered, stuck.queued, stuck.dropped) == (100, 1, 10, 89)
    assert asyncio.get_running_loop().time() < 1.1
