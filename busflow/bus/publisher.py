"""Publisher: the sending end of a topic.

Theory of operation. A publish loops over the topic's tuple of push functions, then checks if a subscription must be
woken. Any case that needs more (a blocking queue, a kept history, another thread, an endpoint that is not attached)
goes through `_publish_carefully`. So the common path pays for one test, one comparison of types and one thread number.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from busflow.bus.endpoint import Endpoint
from busflow.bus.events import DeadlineMissed, Event, LivelinessLost, Notices, PublisherMatched
from busflow.bus.expiry import Perishable, SilenceTimer
from busflow.bus.qos import Liveliness
from busflow.bus.statistics import PublisherStatistics
from busflow.clock import NS_PER_S
from busflow.errors import IncompatibleType, NotRunning, WouldBlock
from busflow.interfaces.message import Message, shown_value, type_name

if TYPE_CHECKING:
    from busflow.bus.topic import Topic

M = TypeVar("M", bound=Message)


class Publisher(Generic[M]):
    """The sending end of a topic."""

    __slots__ = (
        "_deadline", "_direct", "_hand_over", "_history", "_lease", "_lifespan_ns", "_notices", "_only", "_outlet",
        "_pushes", "_remote", "_remote_added", "_thread", "_topic", "alive", "deadlines_missed", "endpoint",
        "liveliness_lost", "on_close", "on_event", "on_first", "published", "remote_receivers", "type",
    )  # fmt: skip

    def __init__(self, message_type: type[M], endpoint: Endpoint) -> None:
        """Create a publisher that `Bus.attach_publisher` connects later."""
        self.type: type[M] = message_type
        self.endpoint: Endpoint = endpoint
        self.published: int = 0
        self.deadlines_missed: int = 0
        self.liveliness_lost: int = 0
        self.alive = True
        self.on_event: Callable[[Event], None] | None = None
        self.on_close: Callable[[Publisher[M]], None] | None = None
        self.on_first: Callable[[], None] | None = None
        """Called once, at the next message published here."""
        self.remote_receivers: Callable[[], frozenset[object]] = frozenset
        """Returns the subscriptions of other processes that match; used by busflow itself."""
        self._remote: frozenset[object] = frozenset()
        self._remote_added = 0
        self._topic: Topic[M] | None = None
        self._outlet: Callable[[M], None] | None = None
        self._thread = 0
        # The thread on which a publish may call `_pushes` directly; 0, no thread, selects `_publish_carefully`.
        self._direct = 0
        self._pushes: tuple[Callable[[M], None], ...] = ()
        self._only: Callable[[M], None] | None = None  # a direct call of a single push is 20 ns faster than a loop
        # `attach` gives the bus's inbox; before that `_attached` raises, so nothing is handed over.
        self._hand_over: Callable[[Callable[[], None]], None] = lambda deliver: deliver()
        qos = endpoint.qos
        self._history: deque[tuple[int, M | Perishable[M]]] | None = deque(maxlen=qos.depth) if qos.latched else None
        self._lifespan_ns = None if qos.lifespan_s is None else round(qos.lifespan_s * NS_PER_S)
        self._deadline: SilenceTimer | None = None
        self._lease: SilenceTimer | None = None
        self._notices = Notices()

    @property
    def topic(self) -> str:
        """The topic's final name."""
        return self.endpoint.topic

    @property
    def is_received(self) -> bool:
        """Whether a subscription, here or in another process, receives what is published here."""
        return self._outlet is not None or self.subscription_count > 0

    @property
    def subscription_count(self) -> int:
        """The number of subscriptions on the topic."""
        return len(self._topic.subscriptions) if self._topic else 0

    def statistics(self) -> PublisherStatistics:
        """Return the publisher's current counts."""
        return PublisherStatistics(
            node=self.endpoint.node,
            topic=self.topic,
            published=self.published,
            kept=len(self.history),
            subscriptions=self.subscription_count,
            alive=self.alive,
            deadlines_missed=self.deadlines_missed,
            liveliness_lost=self.liveliness_lost,
        )

    def publish(self, message: M) -> None:
        """Hand a message to every subscription's queue, without waiting.

        From another thread the message is handed to the loop, in order, through the bus's bounded inbox.

        Raises:
            IncompatibleType: the message is not exactly of the topic's type.
            WouldBlock: an `overflow: block` subscription has no room, or a `send` is waiting; no subscription got it.
            NotRunning: the publisher belongs to no running graph.
        """
        if get_ident() == self._direct and type(message) is self.type:
            topic: Any = self._topic
            self.published += 1
            try:
                if (only := self._only) is not None:
                    only(message)
                else:
                    for push in self._pushes:
                        push(message)
            finally:  # wake the receivers even if the outlet raises
                if topic.idle:
                    topic.wake()
        else:
            self._publish_carefully(message)

    async def send(self, message: M) -> None:
        """Publish once every `overflow: block` subscription has room; first come, first served.

        Raises:
            SendTimeout: no room within the subscription's `block_timeout_s`; no subscription got it.
            IncompatibleType, NotRunning: as `publish`.
        """
        topic = self._attached(message)
        if get_ident() != self._thread:
            raise NotRunning(f"send on {topic.name} must be awaited on the graph's own event loop; use publish")
        if topic.waiting or topic.first_full() is not None:
            await topic.wait_for_room()
        try:
            self._deliver(self._attached(message), message)  # the publisher may have left while it waited
        finally:
            topic.grant()

    def _publish_carefully(self, message: M) -> None:
        topic = self._attached(message)
        if get_ident() != self._thread:
            self._hand_over(lambda: self.publish(message))
            return
        full = topic.first_full()
        if full is not None:
            raise WouldBlock(
                f"{full.endpoint.node} has no room for a message on {topic.name} (overflow: block, depth "
                f"{full.endpoint.qos.depth}); await send(), raise its depth, or choose overflow: drop_oldest"
            )
        if topic.waiting:
            raise WouldBlock(f"a send() on {topic.name} is waiting its turn; await send() to queue behind it")
        self._deliver(topic, message)

    def assert_liveliness(self) -> None:
        """Renew the lease without publishing, for `liveliness: manual_by_topic`."""
        if self._lease is not None and self._topic is not None:
            self._lease.touch()
            if not self.alive:
                self.alive = True
                self._topic.report_changes()

    def _deliver(self, topic: Topic[M], message: M) -> None:
        self.published += 1
        if self.on_first is not None:
            on_first, self.on_first = self.on_first, None
            on_first()
            self.adjust()
        self.assert_liveliness()
        if self._deadline is not None:
            self._deadline.touch()
        item = message if self._lifespan_ns is None else self.as_kept(message)
        if self._history is not None:
            self._history.append((topic.published, item))
        try:
            for push in topic.pushes:
                push(item)
        finally:
            topic.wake()
        if self._outlet is not None:
            self._outlet(message)

    def _attached(self, message: M) -> Topic[M]:
        if type(message) is not self.type:
            raise IncompatibleType(
                f"{self.endpoint.node} publishes {type_name(self.type)} on {self.topic}, but was given "
                f"{shown_value(message)}"
            )
        if self._topic is None:
            raise NotRunning(f"the publisher of {self.topic} in {self.endpoint.node} is not part of a running graph")
        return self._topic

    def attach(self, topic: Topic[M], thread: int, hand_over: Callable[[Callable[[], None]], None]) -> None:
        """Connect to a topic; called by the bus."""
        self._topic, self._thread, self._hand_over = topic, thread, hand_over
        qos = self.endpoint.qos
        if qos.deadline_s is not None:
            self._deadline = SilenceTimer(qos.deadline_s, topic.clock, self._miss_deadline, repeat=True)
        if qos.lease_s is not None and qos.liveliness is Liveliness.MANUAL_BY_TOPIC:
            self._lease = SilenceTimer(qos.lease_s, topic.clock, self._lose_liveliness, repeat=False)
        self._notices.before = topic.subscriptions_added - len(topic.subscriptions)
        topic.add_publisher(self)

    def adopt(self, predecessor: Publisher[M]) -> None:
        """Take the place of the same publisher of the node's previous start; called by the bus.

        The history, the counts and the running time limits carry over. The outlet does not: its owner sets it again.
        The restarted node gets a new event for the subscriptions that match.
        """
        self._topic, self._thread, self._hand_over = predecessor._topic, predecessor._thread, predecessor._hand_over
        self.published, self._history = predecessor.published, predecessor._history
        self.alive, self._notices = predecessor.alive, Notices(predecessor._notices.before)
        self._remote, self._remote_added = predecessor._remote, predecessor._remote_added
        self.deadlines_missed, self.liveliness_lost = predecessor.deadlines_missed, predecessor.liveliness_lost
        self._deadline, predecessor._deadline = predecessor._deadline, None
        self._lease, predecessor._lease = predecessor._lease, None
        if self._deadline is not None:
            self._deadline.on_silence = self._miss_deadline
        if self._lease is not None:
            self._lease.on_silence = self._lose_liveliness
        predecessor._topic, predecessor._direct = None, 0
        predecessor.close()
        if self._topic is not None:
            self._topic.replace(self._topic.publishers, predecessor, self)

    def report_changes(self) -> None:
        """Send the node an event if the matching subscriptions have changed since the last one.

        Used by busflow itself.
        """
        on_event, topic = self.on_event, self._topic
        if on_event is None or topic is None:
            return
        remote = self.remote_receivers()
        self._remote_added += len(remote - self._remote)
        self._remote = remote
        come, current = topic.subscriptions_added + self._remote_added, len(topic.subscriptions) + len(remote)
        for event in self._notices.matching(PublisherMatched, self.topic, come, current):
            on_event(event)

    def close(self) -> None:
        """Leave the topic: published messages stay counted, the history for late joiners is discarded."""
        for watch in (self._deadline, self._lease):
            if watch is not None:
                watch.close()
        if self.on_close is not None:
            on_close, self.on_close = self.on_close, None
            on_close(self)
        if self._topic is not None:
            topic, self._topic, self._direct = self._topic, None, 0
            topic.remove_publisher(self)

    def send_through(self, outlet: Callable[[M], None] | None) -> None:
        """Pass every message to `outlet` too, after the local queues; None while no other process receives it.

        Used by busflow itself.
        """
        self._outlet = outlet
        self.adjust()

    def adjust(self) -> None:
        """Choose between the direct and the careful path; called by the topic when its endpoints change."""
        topic = self._topic
        plain = self._history is None and self._lifespan_ns is None and self._deadline is None and self._lease is None
        plain = plain and topic is not None and not topic.blocking and not topic.waiting and self.on_first is None
        if topic is None or not plain:
            self._direct = 0
            return
        self._direct = self._thread
        self._pushes = topic.pushes if self._outlet is None else (*topic.pushes, self._outlet)
        self._only = self._pushes[0] if len(self._pushes) == 1 else None

    @property
    def perishable(self) -> bool:
        """Whether messages published here can expire; used by busflow itself."""
        return self._lifespan_ns is not None

    @property
    def history(self) -> tuple[tuple[int, M | Perishable[M]], ...]:
        """The messages a transient_local publisher keeps for late joiners: (order on the topic, message)."""
        return tuple(self._history or ())

    def as_kept(self, message: M) -> M | Perishable[M]:
        """Return the message as it is queued: with its expiry time, if the publisher has a lifespan.

        Used by busflow itself.
        """
        if self._lifespan_ns is None or self._topic is None:
            return message
        return Perishable(message, self._topic.clock.monotonic_ns() + self._lifespan_ns)

    def remember(self, items: Sequence[M | Perishable[M]]) -> None:
        """Add messages that this remote publisher published before it was discovered to the history.

        Used by busflow itself.
        """
        if self._history is not None:
            self._history = deque([*((0, item) for item in items), *self._history], self._history.maxlen)

    def forget(self, item: M | Perishable[M]) -> None:
        """Remove a remembered message from the history, since it now arrives and is added anew.

        Used by busflow itself.
        """
        if self._history is not None:
            self._history = deque((each for each in self._history if each[1] is not item), self._history.maxlen)

    def _miss_deadline(self) -> None:
        self.deadlines_missed += 1
        if self.on_event is not None:
            self.on_event(DeadlineMissed(self.topic, self.deadlines_missed))

    def _lose_liveliness(self) -> None:
        self.alive: bool = False
        self.liveliness_lost += 1
        if self.on_event is not None:
            self.on_event(LivelinessLost(self.topic, self.liveliness_lost))
        if self._topic is not None:
            self._topic.report_changes()

    def __repr__(self) -> str:
        return f"<Publisher {self.topic} of {self.endpoint.node}: {self.published} published>"
