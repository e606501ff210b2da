"""Subscription: the receiving end of a topic, and its line of the ledger."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Callable, Coroutine, Sequence
from typing import TYPE_CHECKING, Any, Protocol, Self, TypeVar, cast

from busflow.bus.delivery import Recipient
from busflow.bus.endpoint import Endpoint
from busflow.bus.events import UNWANTED, DeadlineMissed, Event, Notices, SubscriptionMatched
from busflow.bus.expiry import Perishable, SilenceTimer, expire, fresh
from busflow.bus.qos import Overflow
from busflow.bus.queues import Queue, create_queue
from busflow.bus.statistics import SubscriptionStatistics
from busflow.bus.topic import Topic
from busflow.errors import Occupied
from busflow.interfaces.message import Message

if TYPE_CHECKING:
    from busflow.bus.dispatcher import Dispatcher
    from busflow.clock import Clock

M = TypeVar("M", bound=Message)

MessageHandler = Callable[[M], None] | Callable[[M], Coroutine[Any, Any, None]]
OnFailure = Callable[[BaseException, Message], None]

_TURN = 128
"""Messages that a reader takes between two turns of the event loop, each of which costs as much as eight messages."""


class Subscription(Recipient[M, Topic[M]]):
    """The receiving end of a topic: a bounded queue, read by a handler or pulled from.

    Pulling: `async for message in subscription` takes them one by one and ends with the graph; `latest` skips to
    the newest. The first message, each 128th that was there without a wait, and any in a cancelled task are preceded
    by a turn of the event loop: timers and other nodes go on beside a reader that is never without a message, and a
    cancelled reader takes none.

    >>> import asyncio
    >>> from busflow import Node, publisher, subscription
    >>> from busflow.msgs.std_msgs import Int64
    >>> from busflow.testing import harness, virtual_time
    >>> class Echo(Node):
    ...     received, out = subscription(Int64, "numbers"), publisher(Int64, "numbers")
    >>> @virtual_time
    ... async def later_callback_runs_first() -> list[str]:
    ...     async with harness(Echo) as lab:
    ...         echo, ran = lab.node(Echo), []
    ...         echo.out.publish(Int64(data=1))
    ...         asyncio.get_running_loop().call_soon(ran.append, "callback")
    ...         await anext(echo.received)
    ...         return ran
    >>> later_callback_runs_first()
    ['callback']
    """

    __slots__ = (
        "_at_close", "_at_start", "_clock", "_deadline", "_ended", "_latest", "_notices", "_observer", "_on_failure",
        "_pause", "_reader", "deadlines_missed", "endpoint", "is_pulled", "link", "lost", "on_close", "on_event",
        "queue", "type",
    )  # fmt: skip

    def __init__(self, message_type: type[M], endpoint: Endpoint, handler: MessageHandler[M] | None = None) -> None:
        """Create a subscription that `Bus.attach_subscription` connects later; without a handler it is pulled from."""
        self.queue: Queue[M | Perishable[M]] = create_queue(endpoint.qos.overflow, endpoint.qos.depth)
        super().__init__(self.queue.items, handler, endpoint.origin)
        self.endpoint: Endpoint = endpoint
        self.type: type[M] = message_type
        self.deadlines_missed: int = 0
        self.lost: Counter[str] | None = None
        """The messages of other processes that never arrived, by reason; None if there are none."""
        self.on_event: Callable[[Event], None] | None = None
        self.on_close: Callable[[Self], None] | None = None
        self.link: Link | None = None
        self.is_pulled: bool = handler is None
        self._observer: Callable[[M], None] | None = None
        self._latest: M | None = None
        self._clock: Clock | None = None
        self._on_failure: OnFailure | None = None
        self._deadline: SilenceTimer | None = None
        self._notices = Notices()
        self._at_start = 0
        self._at_close: int | None = None
        self._ended = False
        self._reader: asyncio.Task[Any] | None = None
        """The task that pulls, from its first checkpoint on."""
        self._pause = 0
        """The number of delivered messages at which the next checkpoint is due."""

    @property
    def topic(self) -> str:
        """The topic's final name."""
        return self.endpoint.topic

    @property
    def publisher_count(self) -> int:
        """The number of publishers on the topic."""
        return len(self._source.publishers) if self._source else 0

    @property
    def published(self) -> int:
        """The number of messages published to this subscription since it attached."""
        if self._at_close is not None:
            return self._at_close
        return self._source.published - self._at_start if self._source else 0

    def statistics(self) -> SubscriptionStatistics:
        """Return the ledger's current line of this subscription."""
        drops, qos = self.drops, self.endpoint.qos
        return SubscriptionStatistics(
            node=self.endpoint.node,
            topic=self.topic,
            depth=qos.depth,
            overflow=qos.overflow,
            published=self.published,
            delivered=self.delivered,
            dropped=drops.total(),
            queued=self.queued,
            drops=dict(drops),
            deadlines_missed=self.deadlines_missed,
            lost={} if self.lost is None else dict(+self.lost),
        )

    @property
    def drops(self) -> Counter[str]:
        """The number of messages dropped here, by reason."""
        drops = Counter(self.queue.drops)
        lost = self.published - self.delivered - self.queued - drops.total()
        if not self.queue.counts_overflow and lost > 0:
            drops["overflow"] += lost
        return drops

    @property
    def queued(self) -> int:
        """The number of messages queued here or held by the link."""
        return len(self.queue) if self.link is None else len(self.queue) + self.link.held

    @property
    def full(self) -> bool:
        """Whether the queue has no room for the next message; expired messages are discarded first."""
        if self.queued >= self.queue.depth:
            self.discard_expired()
        return self.queued >= self.queue.depth

    def discard_expired(self) -> None:
        """Drop the queued messages that have expired; used by busflow itself."""
        source = self._source
        if source is not None and source.perishable and (expired := expire(self.items, source.clock)):
            self.queue.drops["expired"] += expired

    def discard_queued(self, reason: str) -> None:
        """Drop all queued messages, for this reason; used by busflow itself."""
        while self.items:
            self.queue.discard(reason)

    # Pulling.

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> M:
        if self.delivered >= self._pause or self._reader.cancelling():  # type: ignore[union-attr]  # set by a checkpoint
            await self._checkpoint()
        while (message := self._take()) is None:
            if self._ended:
                raise StopAsyncIteration
            if self._wakeup is not None:
                raise Occupied(f"two tasks wait for {self.topic} in {self.endpoint.node}; subscribe twice instead")
            try:
                await self._wait()
            except asyncio.CancelledError:
                self._pause, self._reader = 0, None  # else the task stays, and with its error all that it read
                raise
            self._pause = 0 if self._ended else self.delivered + _TURN
        return message

    async def _checkpoint(self) -> None:
        """Let the event loop have its turn, so that a reader that never waits starves no timer; raise if cancelled."""
        self._refuse_beside_handler()
        self._reader = asyncio.current_task()
        await asyncio.sleep(0)
        self._pause = self.delivered + _TURN

    @property
    def latest(self) -> M | None:
        """The newest message, or None before the first; older ones still waiting are dropped as `superseded`.

        Raises:
            Occupied: the subscription has a handler.
        """
        self._refuse_beside_handler()
        self.discard_expired()
        while len(self.queue) > 1:
            self.queue.discard("superseded")
        self._take()
        return self._latest

    def _take(self) -> M | None:
        """Take the oldest message that has not expired, if there is one."""
        items: Any = self.items
        message: M | None = None
        while items and message is None:
            message = items.popleft()
            if type(message) is Perishable:
                message = self._fresh(message)
        if message is not None:
            self._latest = message
            self.delivered += 1
            if self._observer is not None:
                self._observer(message)
        if self._source is not None and self._source.waiting:
            self._source.grant()
        return message

    # Receiving messages.

    def observe(self, listener: Callable[[M], None]) -> None:
        """Call `listener` with every message just before it is delivered; without listeners this costs nothing.

        Used by busflow itself.
        """
        inner: Any = self._observer if self._handler is None else self._handler

        def observed(message: M) -> Any:
            listener(message)
            return inner(message)

        if self._handler is None:
            self._observer = listener if inner is None else observed
        else:
            self._handler = observed

    def attach(self, topic: Topic[M], dispatcher: Dispatcher, on_failure: OnFailure) -> None:
        """Connect to a topic and receive its messages for late joiners; called by the bus."""
        self._source, self._dispatcher, self._on_failure = topic, dispatcher, on_failure
        self._at_start = topic.published
        self._notices.before = topic.publishers_added - len(topic.publishers)
        self._watch(topic.clock)
        if self.endpoint.qos.latched:
            kept = topic.kept()[-self.endpoint.qos.depth :]
            self._at_start -= len(kept)
            for message in kept:
                self.queue.push(message)
        topic.add_subscription(self)

    @property
    def pushes(self) -> tuple[Callable[[M | Perishable[M]], None], ...]:
        """The functions that a publish on the topic calls for this subscription; used by busflow itself."""
        return self.arrivals if self.link is None else (self.link.carry,)

    @property
    def arrivals(self) -> tuple[Callable[[M | Perishable[M]], None], ...]:
        """The functions to call with an arriving message; used by busflow itself."""
        perishable = self._source is not None and self._source.perishable
        push = self._make_room_and_push if perishable else self.queue.fast_push
        if self._deadline is None or self._ended:
            return (push,)
        return (push, self._deadline.touch)

    def report_changes(self) -> None:
        """Send the node events for changes of publishers, liveliness and losses since the last ones.

        Used by busflow itself.
        """
        on_event, topic = self.on_event, self._source
        if on_event is None or topic is None:
            return
        name, notices = self.topic, self._notices
        for event in (
            *notices.matching(SubscriptionMatched, name, topic.publishers_added, len(topic.publishers)),
            *notices.liveliness(name, *topic.liveliness()),
            *notices.losses(name, self.drops),
        ):
            on_event(event)

    def receive(self, item: M | Perishable[M]) -> None:
        """Accept a message that a link has held; used by busflow itself."""
        for arrive in self.arrivals:
            arrive(item)
        if self.idle:
            self.wake()

    def receive_earlier(self, items: Sequence[M | Perishable[M]]) -> None:
        """Accept kept messages that were published before this subscription attached and arrive only now.

        Used by busflow itself.
        """
        self._at_start -= len(items)
        for item in items:
            self.receive(item)

    def discount_duplicate(self) -> None:
        """Do not count the current message: it was already delivered from history; used by busflow itself."""
        self._at_start += 1

    def observe_drops(self, listener: Callable[[str], None]) -> None:
        """Call `listener` with the reason of every drop as it happens; from now on each drop is counted one by one.

        Used by busflow itself.
        """
        self.queue.observe_drops(listener)
        if self._source is not None:
            self._source.rebuild()

    @property
    def keeps_newest(self) -> bool:
        """Whether the newest messages are queued here, however many come before them; used by busflow itself."""
        return self.link is None and self.endpoint.qos.overflow is Overflow.DROP_OLDEST

    def count_overflow(self, count: int) -> None:
        """Count messages that were published, and dropped before they came here; used by busflow itself."""
        self.queue.drops["overflow"] += count

    def count_lost(self, reason: str, count: int) -> None:
        """Count messages that never arrived; of a negative count so many have arrived late; used by busflow itself."""
        self.lost = Counter() if self.lost is None else self.lost
        self.lost[reason] += count

    def report_losses(self) -> None:
        """Send the node an event for lost messages too, one for all losses of the same moment.

        Used by busflow itself.
        """
        self.observe_drops(self._on_drop)

    def close(self) -> None:
        """Leave the topic; iterations end after the queued messages."""
        self.pause()
        if not self._ended and self.on_close is not None:
            self.on_close(self)
        self._ended = True
        self._pause = 0
        self._reader = None
        self._end_wait()
        if self._deadline is not None:
            self._deadline.close()
        if self._source is not None:
            topic, self._at_close = self._source, self.published
            self._source = None
            topic.remove_subscription(self)

    def adopt(self, predecessor: Subscription[M], on_failure: OnFailure) -> None:
        """Take the place of the same subscription of the node's previous start; called by the bus.

        Its queue, counts, topic, link and running deadline carry over. Observers do not: they learn of the new
        subscription as a `BusObserver`. The restarted node gets new events for the publishers that match.
        """
        self._have(predecessor.queue)
        self.queue.ignore_drops()
        self.delivered: int = predecessor.delivered
        self.deadlines_missed, self._at_start = predecessor.deadlines_missed, predecessor._at_start
        self.lost = predecessor.lost
        self._source, self._dispatcher, self._clock = predecessor._source, predecessor._dispatcher, predecessor._clock
        self._on_failure = on_failure
        self._notices = Notices(predecessor._notices.before, predecessor._notices.lost)
        self._deadline, predecessor._deadline = predecessor._deadline, None
        if self._deadline is not None:
            self._deadline.on_silence = self._miss_deadline
        self.link, predecessor.link = predecessor.link, None
        if self.link is not None:
            self.link.target = self
        predecessor._source = None
        predecessor._have(create_queue(predecessor.endpoint.qos.overflow, predecessor.endpoint.qos.depth))
        predecessor.close()
        if self._source is not None:
            self._source.replace(self._source.subscriptions, predecessor, self)

    def _refuse_beside_handler(self) -> None:
        if self._handler is not None:
            raise Occupied(f"what {self.endpoint.node} receives on {self.topic} goes to a handler; subscribe twice")

    def _have(self, queue: Queue[M | Perishable[M]]) -> None:
        """Use this queue; `items` is stored here too, because it is read so often."""
        self.queue = queue
        self.items: deque[Any] = queue.items

    def _fresh(self, item: Any) -> M | None:
        """Return the message of an item; if it has expired, count the drop and return None."""
        message = item if self._clock is None else fresh(item, self._clock)
        if message is None:
            self.queue.drops["expired"] += 1
        return message

    def _failed(self, error: BaseException, item: Any) -> None:
        self.pause()
        cast("OnFailure", self._on_failure)(error, item)

    def _watch(self, clock: Clock) -> None:
        self._clock = clock
        limit_s = self.endpoint.qos.deadline_s
        self._deadline = None if limit_s is None else SilenceTimer(limit_s, clock, self._miss_deadline, repeat=True)

    def _make_room_and_push(self, item: M | Perishable[M]) -> None:
        if self.queue.full:
            self.discard_expired()
        self.queue.push(item)

    def _on_drop(self, reason: str) -> None:
        if self._clock is not None and reason not in UNWANTED and not self._notices.pending:
            self._notices.pending = True
            self._clock.call_at(self._clock.monotonic_ns(), self._report_losses)

    def _report_losses(self) -> None:
        self._notices.pending = False
        self.report_changes()

    def _miss_deadline(self) -> None:
        self.deadlines_missed += 1
        if self.on_event is not None:
            self.on_event(DeadlineMissed(self.topic, self.deadlines_missed))

    def __repr__(self) -> str:
        s = self.statistics()
        return f"<Subscription {s.topic} of {s.node}: {s.delivered} delivered, {s.dropped} dropped, {s.queued} queued>"


class Link(Protocol):
    """A delay or loss that a test, or the wire, puts between a topic and one of its subscriptions."""

    target: Subscription[Any]

    @property
    def held(self) -> int:
        """The number of messages on their way, which count as queued."""
        ...

    def carry(self, item: Any) -> None:
        """Deliver a message to the target now or later, or drop and count it."""
        ...
