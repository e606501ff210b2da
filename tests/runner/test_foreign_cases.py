"""Cases of rclpy's executor, and loads and faults of a whole graph."""

import asyncio
import gc
import threading

import pytest

from busflow import Graph, Node, Parameters, client, on_parameters, publisher, subscription, timer
from busflow.clock import SimClock
from busflow.errors import NodeFailed, NotRunning
from busflow.msgs.std_msgs import Empty, Int64, String
from busflow.msgs.std_srvs import Trigger
from busflow.testing import harness, virtual_time


def graph_of(*nodes):
    return Graph(nodes, clock=SimClock())


@virtual_time
async def test_handler_that_waits_delays_no_other():
    """Case executor/not-lose-callback."""
    ticks = []

    class Waiting(Node):
        absent = client(Trigger, "absent")

        @timer(0.5)
        async def first(self) -> None:
            self.first.cancel()
            await self.absent.ready()

        @timer(1.5)
        def second(self) -> None:
            ticks.append(self.clock.seconds())

    async with graph_of(Waiting):
        await asyncio.sleep(4)
    assert ticks == [1.5, 3.0]


@virtual_time
async def test_spawned_tasks_run_in_order():
    """Case executor/fifo-tasks."""
    ran = []

    async def work(value):
        await asyncio.sleep(0.1)
        ran.append(value)

    class Spawning(Node):
        async def start(self) -> None:
            for value in range(100):
                self.spawn(work(value))

    async with graph_of(Spawning):
        gc.collect()
        await asyncio.sleep(1)
    assert ran == list(range(100))


@virtual_time
async def test_stop_before_the_first_turn_ends():
    """Case executor/shutdown-before-callbacks."""
    ran = []

    class Ticking(Node):
        @timer(0.1)
        def tick(self) -> None:
            ran.append(1)

    graph = graph_of(Ticking)
    await graph.start()
    await graph.stop()
    await asyncio.sleep(1)
    assert ran == []


class Numbers(Node):
    out = publisher(Int64, "numbers")

    @subscription("empty")
    def on_empty(self, _message: Empty) -> None:
        empties.append("empty")

    @subscription("text")
    def on_text(self, message: String) -> None:
        empties.append(message.data)


empties: list[str] = []


@virtual_time
async def test_empty_messages_are_delivered():
    empties.clear()
    async with harness(Numbers) as lab:
        lab.publish("empty", Empty())
        lab.publish("text", String())
        await lab.settle()
        assert empties == ["empty", ""]


@pytest.mark.long
@virtual_time
async def test_thousand_subscriptions_share_one_message():
    """The slow one has lost messages, and no other."""
    received = []

    class Fast(Node):
        @subscription("numbers")
        def on_number(self, number: Int64) -> None:
            received.append(number)

    class Slow(Node):
        @subscription("numbers")
        async def on_number(self, _number: Int64) -> None:
            await asyncio.Event().wait()

    graph = graph_of(Numbers, Slow, *(Fast(name=f"fast{n}") for n in range(999)))
    async with graph:
        for value in range(20):
            graph.node(Numbers).out.publish(Int64(data=value))
            await asyncio.sleep(0.01)
        dropped = {line.node: line.dropped for line in graph.bus.ledger() if line.dropped}
    assert len(received) == 20 * 999
    assert len({id(number) for number in received}) == 20
    assert dropped == {"/slow": 9}


@virtual_time
async def test_a_burst_of_messages_delays_no_timer():
    ticks = []

    class Ticking(Node):
        @timer(0.1)
        def tick(self) -> None:
            ticks.append(self.clock.seconds())

    async with graph_of(Numbers, Ticking) as graph:
        out = graph.node(Numbers).out
        message = Int64(data=1)
        for _ in range(100_000):
            out.publish(message)
        await asyncio.sleep(1.05)
    assert ticks == pytest.approx([n / 10 for n in range(1, 11)])


class Pair(Parameters):
    left: int = 0
    right: int = 0


class Paired(Node):
    parameters: Pair

    @on_parameters
    def changed(self, old: Pair) -> None:
        pairs.append((old.right, self.parameters.left, self.parameters.right))


pairs: list[tuple[int, int, int]] = []


@virtual_time
async def test_conflicting_parameter_sets_take_turns():
    """Ten threads set two parameters together."""
    pairs.clear()
    async with graph_of(Paired) as graph:

        def storm(number):
            for step in range(20):
                value = 1 + number * 100 + step
                graph.set_parameters(Paired, left=value, right=value)

        await asyncio.gather(*(asyncio.to_thread(storm, number) for number in range(10)))
    assert len(pairs) == 200
    assert all(left == right for _, left, right in pairs)
    assert [old for old, _, _ in pairs] == [0, *(right for _, _, right in pairs[:-1])]


@virtual_time
async def test_misuse_has_the_same_error_twice():
    graph = graph_of(Numbers)
    for _ in range(2):
        with pytest.raises(NotRunning):
            graph.publish("numbers", Int64())
    async with graph:
        out = graph.node(Numbers).out
    said = set()
    for _ in range(2):
        with pytest.raises(NotRunning) as caught:
            out.publish(Int64())
        said.add(str(caught.value))
        await graph.stop()
    assert len(said) == 1
    assert threading.active_count() < 20


def test_thread_that_cannot_start_is_named(monkeypatch, golden):
    """The system answers so to one thread too many."""

    def refuse(_thread):
        raise RuntimeError("can't start new thread")

    class Working(Node):
        async def run(self) -> None:
            monkeypatch.setattr(threading.Thread, "start", refuse)
            try:
                await self.run_sync(len, "")
            finally:
                monkeypatch.undo()

    async def main():
        async with Graph([Working]):
            await asyncio.Event().wait()

    with golden.raises(NodeFailed):
        asyncio.run(main())


@pytest.mark.long
@virtual_time
async def test_thousands_of_nodes_and_topics_start():

    class Busy(Node):
        def declare(self) -> None:
            for number in range(10):
                self.create_publisher(Int64, f"~/t{number}")
                self.create_subscription(Int64, f"~/t{number}", lambda _message: None)

    async with graph_of(*(Busy(name=f"n{n}") for n in range(1000))) as graph:
        assert len(graph.report().topics) == 10_000
