"""A node's endpoints: which names and QoS they end up with, who hears of events, and where failures go."""

import asyncio

import numpy as np
import pytest

from busflow import Graph, Message, Node, NodeFailed, QoS, publisher, subscription, timer
from busflow.bus.bus import Bus
from busflow.bus.events import (
    DeadlineMissed,
    Event,
    LivelinessChanged,
    MessageLost,
    PublisherMatched,
    SubscriptionMatched,
)
from busflow.clock import SimClock
from busflow.errors import InvalidDeclaration, InvalidName, LaunchError, NotRunning
from busflow.log import Log
from busflow.node.context import Rng, Surroundings
from busflow.node.handlers import on_event
from busflow.node.node import runtime_of
from busflow.testing import virtual_time


class Number(Message, package="test"):
    data: int = 0


class Relay(Node):
    incoming = subscription(Number, "in", qos=QoS(depth=3))
    outgoing = publisher(Number, "~/out", qos=QoS(depth=4, reliability="best_effort"))

    @subscription("/absolute")
    def hear(self, number: Number) -> None: ...

    @timer(1)
    def tick(self) -> None: ...


def declared(node, **around):
    """A node's runtime once it is declared, as pre-flight does it."""
    clock = SimClock()
    runtime = runtime_of(node)
    runtime.declare(Surroundings(clock, Log(clock), **around))
    return runtime


# Names and QoS.


@virtual_time
async def test_names_are_expanded_within_the_namespace():
    runtime = declared(Relay(name="relay"), namespace="/left")
    assert runtime.full_name == "/left/relay"
    assert [each.topic for each in runtime.endpoints.subscriptions] == ["/left/in", "/absolute"]
    [out] = runtime.endpoints.publishers
    assert (out.topic, out.endpoint.written, out.endpoint.node) == ("/left/relay/out", "~/out", "/left/relay")
    assert [each.endpoint.origin for each in runtime.endpoints.subscriptions] == ["Relay.incoming", "Relay.hear"]
    assert [(each.node, each.name) for each in runtime.endpoints.timers] == [("/left/relay", "tick")]


@virtual_time
async def test_a_remap_gives_the_name_and_counts_used():
    runtime = declared(Relay(), remaps={"in": "/sensors/in", "~/out": "result", "unused": "nothing"})
    assert [each.topic for each in runtime.endpoints.subscriptions] == ["/sensors/in", "/absolute"]
    assert [(each.topic, each.endpoint.remap_rule) for each in runtime.endpoints.publishers] == [("/result", "~/out")]
    assert runtime.used_remaps == {"in", "~/out"}


@virtual_time
async def test_qos_layers_apply_field_by_field():
    layers = {
        "/in": (QoS(depth=5, overflow="block"), QoS(overflow="drop_newest")),
        "/relay/out": (QoS(depth=6),),
    }
    runtime = declared(
        Relay(), publisher_qos=lambda topic: layers.get(topic, ()), subscription_qos=lambda topic: layers.get(topic, ())
    )
    incoming, hear = (each.endpoint.qos for each in runtime.endpoints.subscriptions)
    assert (incoming.depth, incoming.overflow, incoming.reliability) == (5, "drop_newest", "reliable")
    assert (hear.depth, hear.overflow) == (10, "drop_oldest")
    [out] = (each.endpoint.qos for each in runtime.endpoints.publishers)
    assert (out.depth, out.reliability) == (6, "best_effort")


@virtual_time
async def test_an_invalid_topic_name_is_refused_when_declared(golden):
    class Wrong(Node):
        numbers = publisher(Number, "two words")

    with golden.raises(InvalidName):
        declared(Wrong())


@virtual_time
async def test_declaring_connects_nothing_and_connecting_hands_over_nothing():
    class Hearing(Node):
        heard = 0

        @subscription("numbers")
        def hear(self, _number: Number) -> None:
            self.heard += 1

    class Saying(Node):
        numbers = publisher(Number, "numbers")

    bus = Bus(SimClock())
    bus.open()
    hearing, saying = declared(Hearing()), declared(Saying())
    assert bus.topics == {}
    hearing.connect(bus)
    saying.connect(bus)
    saying.node.numbers.publish(Number())
    await asyncio.get_running_loop().settle()
    assert (hearing.node.heard, len(hearing.endpoints.subscriptions[0].queue)) == (0, 1)
    hearing.open()
    await asyncio.get_running_loop().settle()
    assert hearing.node.heard == 1
    hearing.disconnect()
    saying.disconnect()
    topic = bus.topics["/numbers"]
    assert (topic.publishers, topic.subscriptions) == ([], [])
    assert [line.delivered for line in bus.ledger()] == [1]


def test_a_random_generator_can_be_reset():
    one, two = Rng(7, "/left/arm"), Rng(7, "/left/arm")
    assert isinstance(one, np.random.Generator)
    first = one.normal(size=5).tolist()
    assert two.normal(size=5).tolist() == first
    one.reseed()
    assert one.normal(size=5).tolist() == first
    assert Rng(8, "/left/arm").normal(size=5).tolist() != first
    assert Rng(7, "/left/leg").normal(size=5).tolist() != first


# Events.


def graph_of(*what):
    return Graph(what, clock=SimClock())


LIMITED = QoS(deadline_s=1)


class Source(Node):
    numbers = publisher(Number, "numbers", qos=LIMITED)

    @on_event("numbers")
    def on_silence(self, event: DeadlineMissed) -> None:
        self.told = event.count


class Watcher(Node):
    """A node that watches two topics, of which one falls silent."""

    others = subscription(Number, "others", qos=LIMITED)
    numbers = subscription(Number, "numbers", qos=LIMITED)

    async def start(self) -> None:
        self.events, self.waited = [], []

    @on_event("numbers")
    def on_any(self, event: Event) -> None:
        self.events.append(event)

    @on_event("numbers")
    async def on_silence(self, event: DeadlineMissed) -> None:
        await asyncio.sleep(0.1)
        self.waited.append(event)

    @on_event("others")
    def never(self, event: Event) -> None:
        raise AssertionError(event)


@virtual_time
async def test_annotations_select_the_events_of_a_handler():
    graph = graph_of(Source, Watcher)
    async with graph:
        source, watcher = graph.node(Source), graph.node(Watcher)
        source.numbers.publish(Number())
        await asyncio.sleep(2.5)
        there = [SubscriptionMatched("/numbers", 1, 1, 1, 1), LivelinessChanged("/numbers", 1, 0)]
        silence = [DeadlineMissed("/numbers", 1), DeadlineMissed("/numbers", 2)]
        assert watcher.events == there + silence
        assert watcher.waited == silence
        assert source.told == 2
        late = graph.advertise(Number, "numbers", qos=LIMITED)
        late.close()
        await asyncio.sleep(0.2)
        assert watcher.events[4:] == [
            SubscriptionMatched("/numbers", 2, 1, 2, 1),
            LivelinessChanged("/numbers", 2, 0),
            SubscriptionMatched("/numbers", 2, 0, 1, -1),
            LivelinessChanged("/numbers", 1, 0),
        ]
        assert len(watcher.waited) == 2


@virtual_time
async def test_an_event_handlers_messages_are_delivered_at_once():
    class Telling(Watcher):
        alarms = publisher(Number, "alarms")

        @on_event("numbers")
        def on_any(self, event: DeadlineMissed) -> None:
            asyncio.get_running_loop().call_soon(lambda: self.events.append("next"))
            self.alarms.publish(Number(data=event.count))

        @subscription("alarms")
        def hear(self, alarm: Number) -> None:
            self.events.append(alarm.data)

    graph = graph_of(Source, Telling)
    async with graph:
        graph.node(Source).numbers.publish(Number())
        await asyncio.sleep(1.05)
        assert graph.node(Telling).events == [1, "next"]


@virtual_time
async def test_failed_node_gets_no_further_event():
    class Fragile(Watcher):
        @on_event("numbers")
        def on_any(self, event: DeadlineMissed) -> None:
            raise ValueError(event)

        @on_event("numbers")
        def on_silence(self, event: DeadlineMissed) -> None:
            self.events.append(event)

    graph = graph_of(Source, Fragile)
    await graph.start()
    graph.node(Source).numbers.publish(Number())
    with pytest.raises(NodeFailed):
        await graph.wait()
    assert graph.node(Fragile).events == []


class Failing(Node):
    numbers = subscription(Number, "numbers", qos=LIMITED)

    @on_event("numbers")
    def hear(self, event: DeadlineMissed) -> None:
        raise ValueError(event)


class FailingLater(Failing):
    async def hear(self, event):
        await asyncio.sleep(0)
        raise ValueError(event)


class Forgetful(Failing):
    def hear(self, event):
        return asyncio.sleep(event.count)


@pytest.mark.parametrize("node_class", [Failing, FailingLater, Forgetful])
@virtual_time
async def test_a_failing_event_handler_fails_its_node(node_class, golden):
    graph = graph_of(Source, node_class)
    await graph.start()
    graph.node(Source).numbers.publish(Number())
    with golden.raises(NodeFailed):
        await graph.wait()
    assert asyncio.get_running_loop().time() == 1


@virtual_time
async def test_stopped_node_gets_no_event():
    class Slow(Watcher):
        async def stop(self) -> None:
            await asyncio.sleep(3)

    graph = graph_of(Source, Slow)
    graph.course.grace_s = 60
    async with graph:
        graph.node(Source).numbers.publish(Number())
        await asyncio.sleep(0.5)
    assert [event for event in graph.node(Slow).events if isinstance(event, DeadlineMissed)] == []


@virtual_time
async def test_an_unknown_event_topic_suggests_the_nearest():
    class Misspelt(Node):
        numbers = subscription(Number, "numbers")

        @on_event("numbrs")
        def hear(self, event: Event) -> None: ...

    with pytest.raises(LaunchError, match=r"Misspelt\.hear .*'/numbers'"):
        await graph_of(Misspelt).start()


@virtual_time
async def test_handler_mistake_is_reported_before_the_start(golden):
    class Mistaken(Node):
        @subscription("numbers")
        def hear(self, number) -> None: ...

    with golden.raises(LaunchError):
        await graph_of(Mistaken).start()
    with pytest.raises(InvalidDeclaration):
        declared(Mistaken())


# Failures.


@virtual_time
async def test_a_failure_names_its_origin_and_message():
    class Parts(Node):
        numbers = publisher(Number, "numbers")

        async def start(self) -> None:
            self.failing = None

        @timer(1)
        def tick(self) -> None:
            self.numbers.publish(Number(data=1))
            if self.failing == "tick":
                raise ValueError

        @subscription("numbers")
        def hear(self, _number: Number) -> None:
            if self.failing == "hear":
                raise ValueError

        async def work(self) -> None:
            await asyncio.sleep(1)
            raise ValueError

    origins = {
        "tick": ("Parts.tick (timer)", None),
        "hear": ("Parts.hear (subscription /numbers)", Number(data=1)),
        "work": ("Parts (task work)", None),
    }
    for part, (origin, message) in origins.items():
        graph = graph_of(Parts)
        await graph.start()
        parts = graph.node(Parts)
        parts.failing = part
        if part == "work":
            parts.spawn(parts.work())
        with pytest.raises(NodeFailed):
            await graph.wait()
        [failure] = graph.failures
        assert (failure.node, failure.origin, failure.message) == ("/parts", origin, message)


@virtual_time
async def test_node_learns_of_all_matched_endpoints():
    heard = []

    class Both(Node):
        numbers = publisher(Number, "numbers")
        others = subscription(Number, "others")

        @on_event("numbers")
        def on_receiver(self, event: PublisherMatched) -> None:
            heard.append(event)

        @on_event("others")
        def on_source(self, event: SubscriptionMatched) -> None:
            heard.append(event)

    class Other(Node):
        others = publisher(Number, "others")
        numbers = subscription(Number, "numbers")

    async with graph_of(Other, Both) as graph:
        await asyncio.sleep(0)
        assert set(heard) == {PublisherMatched("/numbers", 1, 1, 1, 1), SubscriptionMatched("/others", 1, 1, 1, 1)}
        heard.clear()
        late = graph.subscribe(Number, "numbers")
        await asyncio.sleep(0)
        late.close()
        await asyncio.sleep(0)
        assert heard == [PublisherMatched("/numbers", 2, 1, 2, 1), PublisherMatched("/numbers", 2, 0, 1, -1)]


@virtual_time
async def test_losses_of_one_moment_are_one_event():
    heard = []

    class Slow(Node):
        numbers = subscription(Number, "numbers", qos=QoS(depth=2))

        @on_event("numbers")
        def on_loss(self, event: MessageLost) -> None:
            heard.append(event)

    async with graph_of(Slow) as graph:
        for burst in (5, 1, 0):
            for _ in range(burst):
                graph.publish("numbers", Number())
            await asyncio.sleep(1)
        assert heard == [MessageLost("/numbers", 3, 3), MessageLost("/numbers", 4, 1)]
        assert graph.node(Slow).numbers.latest is not None
        await asyncio.sleep(1)
        assert len(heard) == 2, "what a newer one has superseded is not lost"


@virtual_time
async def test_closed_endpoints_share_one_line_of_the_ledger():
    async with graph_of(Source) as graph:
        node = graph.node(Source)
        before = len(runtime_of(node).endpoints.subscriptions), len(runtime_of(node).endpoints.publishers)
        for _ in range(100):
            node.create_subscription(Number, "many").close()
            node.create_publisher(Number, "many").close()
        assert (len(runtime_of(node).endpoints.subscriptions), len(runtime_of(node).endpoints.publishers)) == before
        assert len([line for line in graph.bus.ledger() if line.topic == "/many"]) == 1


@virtual_time
async def test_runtime_drops_its_queued_messages():
    bus, runtime = Bus(SimClock()), declared(Relay())
    bus.open()
    runtime.connect(bus)
    source = declared(Relay(name="source"), remaps=())
    source.connect(bus)
    source.create_publisher(Number, "/in", None, origin="here").publish(Number())
    runtime.discard_queued("stopped")
    incoming = runtime.endpoints.subscriptions[0].statistics()
    assert (incoming.topic, incoming.published, incoming.queued, incoming.drops) == ("/in", 1, 0, {"stopped": 1})


@virtual_time
async def test_created_subscription_needs_a_callable_handler(golden):
    async with graph_of(Source) as graph:
        with golden.raises(InvalidDeclaration):
            graph.node(Source).create_subscription(Number, "many", 3)


@virtual_time
async def test_node_creates_nothing_after_its_end(golden):
    async with graph_of(Source) as graph:
        node = graph.node(Source)
    with golden.raises(NotRunning):
        node.create_publisher(Number, "many")


@virtual_time
async def test_declared_node_has_no_bus_yet(golden):
    with golden.raises(NotRunning):
        declared(Relay()).bus  # noqa: B018  # a property that raises
