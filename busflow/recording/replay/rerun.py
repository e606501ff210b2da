"""Rerun: runs nodes again with the inputs of a recording, on the recording's time, one event after the other.

Everything that came to the nodes from outside comes again, in the recorded order: messages, ticks of their timers,
changes of their parameters, requests, and the answers to their own requests. The nodes handle each event completely
before the next one comes.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, cast

from busflow.bus.bus import BusObserver
from busflow.bus.endpoint import PARAMETER_EVENTS
from busflow.clock import Duration, Time
from busflow.errors import BagError, BusflowError, NodeFailed
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Message, type_name
from busflow.node.node import runtime_of
from busflow.recording.recorder.ticks import TICKS
from busflow.recording.replay.calls import Calls, plain_of
from busflow.recording.replay.comparison import Check, Published
from busflow.recording.replay.history import Past, change_of, loss_notes, shares, tick_of
from busflow.recording.replay.inputs import Inputs
from busflow.recording.replay.nodes import OF_THE_RUN, plain
from busflow.recording.replay.ticks import ReplayClock
from busflow.text import counted

if TYPE_CHECKING:
    from busflow.bus.publisher import Publisher
    from busflow.bus.subscription import Subscription
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel, Entry
    from busflow.runner.graph import Graph
    from busflow.runner.loops.virtual import VirtualLoop

EntryHandler = Callable[["Entry"], None]
"""Handles the recorded messages of one channel."""


class Rerun(BusObserver):
    """A graph of the nodes that run again, and the recording that drives it."""

    def __init__(
        self,
        graph: Graph,
        bag: Bag,
        past: Past,
        check: Check,
        *,
        clock: ReplayClock,
        others_publish: set[str],
        keep: int | None,
    ) -> None:
        """Prepare the rerun of a graph that has not started.

        Args:
            graph: The nodes.
            bag: The recording.
            past: The facts of the recording that are needed before the first message.
            check: Compares the recorded messages with those that the nodes publish now.
            clock: The graph's clock.
            others_publish: Topics on which other nodes of the recorded run publish too.
            keep: The number of messages of each topic that `outputs` keeps, the newest; None keeps all.
        """
        self.outputs: dict[str, deque[Message]] = {}
        """The messages that the nodes have published, by topic."""
        self.notes: list[str] = []
        self._graph, self._bag, self._past, self._check, self._clock = graph, bag, past, check, clock
        self._loop = cast("VirtualLoop", asyncio.get_running_loop())
        self._nodes = {each.runtime.full_name for each in graph.plan().nodes}
        self._others, self._keep = others_publish, keep
        self._channels = {each.topic: each for each in bag.channels}
        self._published: dict[str, str] = {}
        self._calls = Calls(graph, check, past)
        self._inputs = Inputs(graph, self._published, shares(bag, self._nodes), self._calls.goals)
        graph.attach(self._calls)
        self._handlers: dict[Channel, tuple[EntryHandler, bool] | None] = {}
        self._initially_set: set[str] = set()
        """Nodes whose first recorded parameter event has been skipped."""
        self._began = past.started_ns > 0
        graph.bus.observe(self)

    async def run(self) -> None:
        """Run the nodes through the whole recording."""
        graph = self._graph
        starting = asyncio.create_task(self._start())
        await self._loop.settle()
        try:
            for entry in self._bag.entries():
                if graph.course.ending.is_set():
                    break
                found = self._handler(entry.channel)
                if found is None:
                    continue
                handle, is_event = found
                if is_event:
                    await self._reach(entry.log_time_ns)
                handle(entry)
                if is_event:
                    await self._loop.settle()
            if not graph.course.ending.is_set() and self._bag.end_ns is not None:
                await self._reach(self._bag.end_ns, back=False)
                await self._loop.settle()
        finally:
            self._note_limits()  # before the nodes' endpoints leave the graph
            await self._calls.close()
            now_ns = self._clock.now().nanoseconds
            await graph.stop()
            await starting
        if graph.given_up is not None:
            raise graph.given_up
        for failure in graph.failures:
            self._check.failed(failure.node, now_ns, failure.summary)

    async def _start(self) -> None:
        with suppress(NodeFailed):
            await self._graph.start()

    async def _reach(self, time_ns: int, *, back: bool = True) -> None:
        """Move the clock to a time of the recording; with `back` also backwards, as the recorded clock was set back."""
        if not self._began:  # time is 0 before a simulator's first message, which sets the clock: no time passes
            self._began = time_ns > 0
            self._clock.start_at(Time(time_ns))
            return
        by_ns = time_ns - self._clock.now().nanoseconds
        if self._loop.time_ns() == 0 and by_ns < 0:
            return  # it was recorded before time 0 of the run
        if by_ns > 0:
            reached = self._loop.create_future()
            self._loop.call_at_ns(self._loop.time_ns() + by_ns, lambda: reached.done() or reached.set_result(None))
            await reached
        elif by_ns < 0 and back:
            by = Duration(by_ns)
            self._clock.jump(by)
            if self._past.simulated:
                for listener in tuple(self._clock.on_jump):
                    listener(by)

    # The handler of each channel.

    def _handler(self, channel: Channel) -> tuple[EntryHandler, bool] | None:
        """Return the handler of a channel, and whether its messages are events for the nodes; None to ignore them."""
        if channel not in self._handlers:
            self._handlers[channel] = self._find_handler(channel)
        return self._handlers[channel]

    def _find_handler(self, channel: Channel) -> tuple[EntryHandler, bool] | None:
        topic = channel.topic
        if topic == TICKS:
            return self._tick, True
        if topic == PARAMETER_EVENTS:
            return self._change, True
        if topic in self._published:
            return (self._compare, False) if topic in self._check.compared else None
        feed = self._calls.handler(channel) or self._inputs.feed(channel)
        return None if feed is None else (feed, True)

    def _compare(self, entry: Entry) -> None:
        self._check.recorded(entry.channel.topic, Published(entry.log_time_ns, entry.payload))

    def _tick(self, entry: Entry) -> None:
        tick = tick_of(entry)
        if tick is not None and tick.node in self._nodes:
            self._clock.tick(tick)

    def _change(self, entry: Entry) -> None:
        node, values = change_of(entry)
        if node not in self._nodes:
            return
        # The first event of a node in a recording of busflow has the parameters that it starts with here anyway.
        if self._past.by_busflow and node not in self._initially_set:
            self._initially_set.add(node)
            return
        store = runtime_of(self._graph.node(node)).parameters
        known = {name: plain(value, store.infos[name]) for name, value in values.items() if name in store.infos}
        try:
            refused = store.set(known).reason
        except BusflowError as error:
            refused = str(error)
        if refused:
            text = f"a recorded change of parameters is refused now: {refused}"
            self._check.failed(node, entry.log_time_ns, text)

    # Messages that the nodes receive and publish.

    def subscription_added(self, subscription: Subscription[Any]) -> None:  # noqa: ARG002  # overrides
        """Look again for the handlers of channels, since a node receives one more topic."""
        self._handlers.clear()

    def publisher_added(self, publisher: Publisher[Any]) -> None:
        """Compare a topic's messages with the recorded ones from a node's first publisher on."""
        self._handlers.clear()
        topic = publisher.topic
        if publisher.endpoint.node not in self._nodes or topic in OF_THE_RUN or topic in self._published:
            return
        self._published[topic] = publisher.endpoint.node
        self.outputs[topic] = deque(maxlen=self._keep)
        if topic in self._others:
            self.notes.append(f"{topic} is not compared: other nodes publish it too; a recording names no publisher")
        else:
            self._refuse_another_type(publisher)
            self._check.watch(topic, plain_of(publisher.type))
        self._graph.bus.tap(self._graph.bus.topics[topic], self._listener(publisher))

    def _listener(self, publisher: Publisher[Any]) -> Callable[[Message], None]:
        topic, encode = publisher.topic, TypeSupport(publisher.type).encode
        compared = topic not in self._others
        outputs, check, clock = self.outputs[topic], self._check, self._clock

        def compare(message: Message) -> None:
            outputs.append(message)
            if compared:
                check.replayed(topic, Published(clock.now().nanoseconds, encode(message)))

        return compare

    def _refuse_another_type(self, publisher: Publisher[Any]) -> None:
        channel = self._channels.get(publisher.topic)
        if channel is None:
            return
        support = TypeSupport(publisher.type)
        if channel.type_name != support.name or channel.type.type_hash != support.type_hash:
            raise BagError(
                f"{publisher.topic} was recorded as {channel.type_name}, and {publisher.endpoint.node} publishes "
                f"{'another version of it' if channel.type_name == support.name else type_name(publisher.type)}",
                fix="messages of two types cannot be compared: record the topic again",
            )

    def _note_limits(self) -> None:
        """Note what the recording lacks, and what of it was not used."""
        topics = {*self._published, *self._inputs.topics}
        self.notes += loss_notes(self._bag, topics, self._nodes)
        silent = self._inputs.not_in(self._channels)
        self.notes += [f"{topic} is not in the recording: {node} received nothing on it" for topic, node in silent]
        if self._clock.unmet:
            ticks = counted(self._clock.unmet, "tick of a timer was", "ticks of timers were")
            self.notes.append(f"{ticks} recorded for which no timer waited in the replay")
        if TICKS not in self._channels and any(each.runtime.endpoints.timers for each in self._graph.supervisors):
            self.notes.append("no ticks were recorded: timers tick from the start, before an input of the same instant")
