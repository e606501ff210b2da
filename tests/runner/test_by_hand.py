"""Nodes that are stopped, started and restarted by hand, while the others go on, on virtual time."""

import asyncio
from typing import ClassVar

import anyio
import pytest

from busflow import Graph, Message, Node, NodeFailed, Parameters, publisher, service, subscription, supervised, timer
from busflow.clock import SimClock
from busflow.errors import NotRunning
from busflow.msgs.std_srvs import Trigger
from busflow.runner.by_hand import Order, OrdersByHand
from busflow.runner.extension import Extension
from busflow.testing import harness, virtual_time


class Number(Message, package="test"):
    data: int = 0


class SourceParameters(Parameters):
    step: int = 1


class Source(Node):
    """Counts up."""

    parameters: SourceParameters
    numbers = publisher(Number, "numbers")
    drawn: ClassVar[list[int]] = []
    count = 0

    async def start(self):
        self.drawn.append(int(self.rng.integers(1 << 30)))

    @timer(0.1)
    def tick(self):
        self.count += self.parameters.step
        self.numbers.publish(Number(data=self.count))

    @service(Trigger, "~/ask")
    def ask(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)


class Sink(Node):
    """Receives numbers."""

    @subscription("numbers")
    def on_number(self, number: Number):
        pass


class SlowSink(Node):
    """Takes a second for each number."""

    @subscription("numbers")
    async def on_number(self, _number: Number):
        await asyncio.sleep(1)


class Once(Node):
    """Ends by itself."""

    async def run(self):
        await asyncio.sleep(0.1)


class Leaver(Node):
    """Fails on its way out."""

    async def run(self):
        await asyncio.Event().wait()

    async def stop(self):
        raise ValueError("the cable is loose")


class Shielded(Node):
    """A node that no cancellation reaches."""

    async def stop(self):
        with anyio.CancelScope(shield=True):
            await asyncio.Event().wait()


class Late(Node):
    """Starts only after a second."""

    async def start(self):
        await asyncio.sleep(1)


class Flaky(Node):
    """Fails soon after each start."""

    async def run(self):
        await asyncio.sleep(0.05)
        raise ValueError("no device")


def state(graph, name):
    return next(node for node in graph.report().nodes if node.name == name)


def line(graph, node):
    (found,) = [each for each in graph.report().topics[0].subscriptions if each.node == node]
    assert found.published == found.delivered + found.dropped + found.queued
    return found


async def order(lab, wanted, *names):
    """Give an order, and let it be carried out."""
    given = OrdersByHand(lab.graph).give(wanted, names)
    await lab.settle()
    return [each.name for each in given]


@virtual_time
async def test_stopped_node_leaves_its_topics_and_services():
    async with harness(Source, Sink) as lab:
        await lab.advance(1)
        assert await order(lab, Order.STOP, "/source", "/unknown") == ["/source"]
        published = lab.graph.bus.topics["/numbers"].published
        await lab.advance(1)
        topic, asked = lab.graph.bus.topics["/numbers"], lab.graph.bus.services["/source/ask"]
        assert (topic.published, topic.publishers, asked.server) == (published, [], None)
        assert state(lab.graph, "/source").state == "stopped by hand"
        assert state(lab.graph, "/sink").state == "running"
    assert state(lab.graph, "/source").state == "stopped by hand"
    assert lab.graph.exit_code == 0


@virtual_time
async def test_accounts_go_on_after_a_start():
    async with harness(Source, Sink) as lab:
        for name in ("/source", "/sink"):
            await lab.advance(1)
            await order(lab, Order.RESTART, name)
        await lab.advance(1)
        before = line(lab.graph, "/sink")
        assert before.delivered >= 29
        await order(lab, Order.STOP, "/sink")
        await lab.advance(1)
        assert line(lab.graph, "/sink") == before
        await order(lab, Order.START, "/sink")
        await lab.advance(1)
        assert line(lab.graph, "/sink").delivered == before.delivered + 10
        (ticks,) = lab.graph.report().timers
        assert ticks.fired == lab.graph.bus.topics["/numbers"].published >= 49
        sink = state(lab.graph, "/sink")
        assert (sink.stopped_by_hand, sink.started_by_hand, sink.restarts, sink.failures) == (2, 2, 0, 0)


@virtual_time
async def test_queued_messages_are_dropped_by_a_stop():
    async with harness(Source, SlowSink) as lab:
        await lab.advance(2)
        queued = line(lab.graph, "/slow_sink").queued
        assert queued > 1
        await order(lab, Order.STOP, "/slow_sink")
        stopped = line(lab.graph, "/slow_sink")
        assert (stopped.queued, stopped.drops["stopped by hand"]) == (0, queued)


@pytest.mark.parametrize("policy", ["on-failure", "always"])
@virtual_time
async def test_policy_does_not_restart_a_stopped_node(policy):
    async with harness(supervised(Source, restart=policy), supervised(Flaky, restart=policy)) as lab:
        await lab.advance(0.1)
        assert state(lab.graph, "/flaky").state == "restarting"
        await order(lab, Order.STOP, "/source", "/flaky")
        restarts = state(lab.graph, "/flaky").restarts
        await lab.advance(60)
        for name in ("/source", "/flaky"):
            assert state(lab.graph, name).state == "stopped by hand"
        assert state(lab.graph, "/flaky").restarts == restarts
        await order(lab, Order.START, "/flaky")
        await lab.advance(0.1)
        assert state(lab.graph, "/flaky").restarts == restarts + 1, "its policy is in force again"


@virtual_time
async def test_start_takes_parameters_and_new_random_numbers():
    Source.drawn.clear()
    async with harness(Source) as lab:
        await order(lab, Order.STOP, "/source")
        lab.set_parameters(Source, step=5)
        await order(lab, Order.START, "/source")
        await order(lab, Order.START, "/source")  # which runs already
        await lab.advance(0.1)
        assert lab.node(Source).count == 5
        assert state(lab.graph, "/source").started_by_hand == 1
    assert len(Source.drawn) == len(set(Source.drawn)) == 2


@virtual_time
async def test_dependants_go_on_and_waiting_ones_wait():
    needs = supervised(Sink, depends_on={"late": "ready"}), supervised(Source, depends_on={"late": "started"})
    lab = harness(Late, *needs)
    starting = asyncio.create_task(lab.graph.start())
    await asyncio.sleep(0.5)
    await order(lab, Order.STOP, "/late")
    await asyncio.sleep(20)
    assert [node.state for node in lab.graph.report().nodes] == ["stopped by hand", "waiting", "running"]
    await order(lab, Order.START, "/late")
    await asyncio.sleep(2)
    assert [node.state for node in lab.graph.report().nodes] == ["running"] * 3
    await order(lab, Order.RESTART, "/sink")  # what it needs was met once
    assert state(lab.graph, "/sink").state == "running"
    await starting
    await lab.graph.stop()


@virtual_time
async def test_stop_of_a_waiting_node_ends_its_wait():
    lab = harness(Late, supervised(Sink, depends_on={"late": "ready"}), Source)
    starting = asyncio.create_task(lab.graph.start())
    await asyncio.sleep(0.5)
    await order(lab, Order.STOP, "/sink")
    assert state(lab.graph, "/sink").state == "stopped by hand"
    await order(lab, Order.START, "/sink")
    assert state(lab.graph, "/sink").state == "waiting"
    await starting
    assert state(lab.graph, "/sink").state == "running"
    await lab.graph.stop()
    assert lab.graph.exit_code == 0


@virtual_time
async def test_held_node_starts_only_by_hand():
    lab = harness(Source, Sink)
    lab.graph.course.hold(["/source"])
    async with lab:
        await lab.advance(1)
        assert [node.state for node in lab.graph.report().nodes] == ["stopped by hand", "running"]
        assert lab.graph.bus.topics["/numbers"].published == 0
        await order(lab, Order.START, "/source")
        await lab.advance(1)
        assert line(lab.graph, "/sink").delivered == 10
        assert (await lab.call(Trigger, "source/ask")).success


@virtual_time
async def test_run_goes_on_without_any_running_node():
    async with harness(Source, Once) as lab:
        await lab.advance(1)
        await order(lab, Order.STOP, "/source", "/once")
        await lab.advance(60)
        assert not lab.graph.course.ending.is_set()
        assert [node.state for node in lab.graph.report().nodes] == ["stopped by hand", "stopped"]
        assert state(lab.graph, "/once").stopped_by_hand == 0, "it had ended by itself"
        await order(lab, Order.START, "/once")
        assert state(lab.graph, "/once").state == "running"


@virtual_time
async def test_failing_stop_is_fatal_without_a_policy_only(golden):
    async with harness(supervised(Leaver, restart="on-failure"), Source) as lab:
        for failures in (1, 2):
            await order(lab, Order.STOP, "/leaver")
            leaver = state(lab.graph, "/leaver")
            assert (leaver.state, leaver.failures) == ("stopped by hand", failures)
            golden(leaver.last_failure)
            await order(lab, Order.START, "/leaver")
            assert state(lab.graph, "/leaver").state == "running"
        await order(lab, Order.STOP, "/leaver")
    graph = Graph([Leaver, Source], clock=SimClock())
    await graph.start()
    OrdersByHand(graph).give(Order.STOP, ["/leaver"])
    with golden.raises(NodeFailed):
        await graph.wait()


@virtual_time
async def test_order_is_refused_once_the_run_ends():
    async with harness(Source) as lab:
        orders = OrdersByHand(lab.graph)
        lab.graph.ask_to_stop()
        with pytest.raises(NotRunning, match="ends"):
            orders.give(Order.STOP, ["/source"])


@virtual_time
async def test_orders_are_carried_out_one_by_one():
    async with harness(Source, Sink) as lab:
        orders = OrdersByHand(lab.graph)
        for wanted in (Order.STOP, Order.START, Order.RESTART, Order.STOP, Order.RESTART):
            orders.give(wanted, ["/source", "/sink"])
        await lab.settle()
        for name in ("/source", "/sink"):
            found = state(lab.graph, name)
            assert (found.state, found.stopped_by_hand, found.started_by_hand) == ("running", 3, 3)


@virtual_time
async def test_closed_orders_begin_nothing_more():
    async with harness(Source) as lab:
        orders = OrdersByHand(lab.graph)
        orders.give(Order.STOP, ["/source"])
        orders.close()
        await lab.settle()
        assert state(lab.graph, "/source").state == "running"


def test_node_that_will_not_end_cannot_start(limits, golden):
    limits(start=0.05)

    async def main():
        refused, lines = asyncio.Event(), []

        def write(record):
            lines.append(record.event)
            if "cannot be started" in record.event:
                refused.set()

        async with Graph([supervised(Shielded, restart="always"), Source], sinks=(write,)) as graph:
            OrdersByHand(graph).give(Order.RESTART, ["/shielded"])
            await refused.wait()
            golden(lines[-1])
            assert [node.state for node in graph.report().nodes] == ["stopped by hand", "running"]

    asyncio.run(asyncio.wait_for(main(), 60))


class Reporting(Extension):
    """Keeps the states of all nodes after each order."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.seen: list[list[str]] = []

    def order_carried_out(self) -> None:
        self.seen.append([node.state for node in self.graph.report().nodes])


@virtual_time
async def test_extensions_learn_of_a_carried_out_order():
    graph = Graph([Source, Sink], clock=SimClock())
    extension = Reporting(graph)
    graph.attach(extension)
    await graph.start()
    orders = OrdersByHand(graph)
    orders.give(Order.STOP, ["/source"])
    await asyncio.sleep(1)
    orders.give(Order.START, ["/source"])
    await asyncio.sleep(1)
    await graph.stop()
    assert extension.seen == [["stopped by hand", "running"], ["starting", "running"]]
