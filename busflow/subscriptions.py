"""Subscription: the receiving end of a topic, and its line of the ledger."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, cast

from busflow.accounts import SubscriptionStatistics
from busflow.dispatcher import QUANTUM
from busflow.endpoint import Endpoint
from busflow.errors import Occupied
from busflow.events import DeadlineMissed, Event, SubscriptionMatched
from busflow.failure import is_failure, refuse_coroutine
from busflow.limits import Perishable, Watch, expire, fresh
from busflow.message import Message
from busflow.notices import UNWANTED, Notices
from busflow.qos import Durability
from busflow.queues import Queue, create_queue

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.dispatcher import Dispatcher
    from busflow.link import Link
    from busflow.topic import Topic

M = TypeVar("M", bound=Message)

MessageHandler = Callable[[M], None] | Callable[[M], Coroutine[Any, Any, None]]
OnFailure = Callable[[BaseException, Message], None]


class Subscription(Generic[M]):
    """The receiving end of a topic: a bounded queue, read by a handler or pulled from.

    Pulling: `async for message in subscription` takes them one by one and ends with the graph; `latest` skips to
    the newest.
    """

    __slots__ = (
        "_at_close", "_at_start", "_clock", "_deadline", "_dispatcher", "_doorbell", "_ended", "_handler", "_hear",
        "_is_async", "_latest", "_notices", "_on_failure", "_open", "_topic", "deadlines_missed", "delivered",
        "endpoint", "is_pulled", "link", "on_close", "on_event", "queue", "type",
    )  # fmt: skip

    def __init__(self, message_type: type[M], endpoint: Endpoint, handler: MessageHandler[M] | None = None) -> None:
        """A subscription that `Bus.attach_subscription` has yet to connect; without a handler it is pulled from."""
        self.type = message_type
        self.endpoint = endpoint
        self.delivered = 0
        self.deadlines_missed = 0
        self.on_event: Callable[[Event], None] | None = None
        self.on_close: Callable[[Self], None] | None = None
        self.link: Link | None = None
        self.queue: Queue[M | Perishable[M]] = create_queue(endpoint.qos.overflow, endpoint.qos.depth)
        self.is_pulled = handler is None
        self._handler = handler
        self._is_async = iscoroutinefunction(handler)
        self._hear: Callable[[M], None] | None = None
        self._topic: Topic[M] | None = None
        self._dispatcher: Dispatcher | None = None
        self._on_failure: OnFailure | None = None
        self._doorbell: asyncio.Future[None] | None = None
        self._latest: M | None = None
        self._clock: Clock | None = None
        self._deadline: Watch | None = None
        self._notices = Notices()
        self._at_start = 0
        self._at_close: int | None = None
        self._open = False
        self._ended = False
        self._listen()

    @property
    def topic(self) -> str:
        """The topic's final name."""
        return self.endpoint.topic

    @property
    def publisher_count(self) -> int:
        """How many publishers there are on the topic."""
        return len(self._topic.publishers) if self._topic else 0

    @property
    def published(self) -> int:
        """How many messages were published to this subscription since it came."""
        if self._at_close is not None:
            return self._at_close
        return self._topic.published - self._at_start if self._topic else 0

    def statistics(self) -> SubscriptionStatistics:
        """The ledger's line of this subscription, as it stands now."""
        queue, qos = self.queue, self.endpoint.qos
        return SubscriptionStatistics(
            node=self.endpoint.node,
            topic=self.topic,
            depth=qos.depth,
            overflow=qos.overflow,
            published=self.published,
            delivered=self.delivered,
            dropped=queue.dropped,
            queued=self.queued,
            drops=dict(queue.drops),
            deadlines_missed=self.deadlines_missed,
        )

    @property
    def queued(self) -> int:
        """How many messages wait here, or are on their way."""
        return len(self.queue) if self.link is None else len(self.queue) + self.link.held

    @property
    def full(self) -> bool:
        """Whether the next message finds no room; what has expired while it waited makes room first."""
        if self.queued >= self.queue.depth:
            self.discard_expired()
        return self.queued >= self.queue.depth

    def discard_expired(self) -> None:
        """Drop what has outlived its lifespan while it waited."""
        if self._topic is None or not self._topic.perishable:
            return
        if expired := expire(self.queue.items, self._topic.clock):
            self.queue.drops["expired"] += expired

    # Pulling.

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self) -> M:
        self._refuse_beside_handler()
        while (message := self._take()) is None:
            if self._ended:
                raise StopAsyncIteration
            await self._ring()
        return message

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
        """Hand over the oldest message that has not expired, if one waits."""
        items: Any = self.queue.items
        message: M | None = None
        while items and message is None:
            message = items.popleft()
            if type(message) is Perishable:
                message = self._fresh(message)  # type: ignore[arg-type]  # of this subscription's type
        if message is not None:
            self._latest = message
            self.delivered += 1
            if self._hear is not None:
                self._hear(message)
        if self._topic is not None and self._topic.waiting:
            self._topic.grant()
        return message

    def _fresh(self, item: M | Perishable[M]) -> M | None:
        """The message of an item, or None and one more drop when it has expired."""
        message = fresh(item, self._clock) if isinstance(item, Perishable) and self._clock is not None else item
        if message is None:
            self.queue.drops["expired"] += 1
        return message  # type: ignore[return-value]  # a Perishable is unpacked above once there is a clock

    # Being handed messages.

    def observe(self, hear: Callable[[M], None]) -> None:
        """Have every message told just before it is handed over; who does not ask pays nothing."""
        inner: Any = self._hear if self._handler is None else self._handler

        def heard(message: M) -> Any:
            hear(message)
            return inner(message)

        if self._handler is None:
            self._hear = hear if inner is None else heard
        else:
            self._handler = heard

    def attach(self, topic: Topic[M], dispatcher: Dispatcher, on_failure: OnFailure) -> None:
        """Connect to a topic and receive what it keeps for late joiners; called by the bus."""
        self._topic, self._dispatcher, self._on_failure = topic, dispatcher, on_failure
        self._at_start = topic.published
        self._notices.before = topic.publishers_come - len(topic.publishers)
        self._watch(topic.clock)
        topic.subscriptions.append(self)
        topic.subscriptions_come += 1
        if self.endpoint.qos.durability is Durability.TRANSIENT_LOCAL:
            kept = topic.kept()[-self.endpoint.qos.depth :]
            self._at_start -= len(kept)
            for message in kept:
                self.queue.push(message)
        topic.rebuild()

    @property
    def pushes(self) -> tuple[Callable[[M | Perishable[M]], None], ...]:
        """What a publish on the topic has to call for this subscription."""
        return self.arrivals if self.link is None else (self.link.carry,)

    @property
    def arrivals(self) -> tuple[Callable[[M | Perishable[M]], None], ...]:
        """What has to hear of a message that arrives."""
        push = self._make_room_and_push if self._topic is not None and self._topic.perishable else self.queue.push
        if self._deadline is None or self._ended:
            return (push,)
        return (push, self._deadline.touch)

    def tell_changes(self) -> None:
        """Tell the node who publishes here, as far as that has changed since it was last told."""
        tell, topic = self.on_event, self._topic
        if tell is None or topic is None:
            return
        name, notices = self.topic, self._notices
        for event in (
            *notices.matching(SubscriptionMatched, name, topic.publishers_come, len(topic.publishers)),
            *notices.liveliness(name, *topic.liveliness()),
            *notices.losses(name, self.queue.drops),
        ):
            tell(event)

    def hear_losses(self) -> None:
        """Tell the node also of messages that were lost, together those of one moment."""
        self.queue.hear_drops(self._on_drop)

    def open(self) -> Coroutine[Any, Any, None] | None:
        """Begin to hand over; an `async` handler needs the returned coroutine run as a task of its node."""
        self._open = True
        if self._handler is None:
            return None
        if self._is_async:
            return self._pump(self._handler)
        if self.queue.items:
            self._get_in_line()
        else:
            self.queue.idle = True
        return None

    def pause(self) -> None:
        """Hand over no more; what arrives waits in the queue."""
        self._open = False
        self.queue.idle = False

    def close(self) -> None:
        """Leave the topic; iterations end after what still waits."""
        self.pause()
        if not self._ended and self.on_close is not None:
            self.on_close(self)
        self._ended = True
        self._answer()
        if self._deadline is not None:
            self._deadline.close()
        if self._topic is not None:
            topic, self._at_close = self._topic, self.published
            self._topic = None
            topic.forget_subscription(self)

    def adopt(self, predecessor: Subscription[M], on_failure: OnFailure) -> None:
        """Take over the place of the same subscription of an earlier life of this node; called by the bus.

        Its queue, account and topic, the link before it and the deadline that runs go over. Who observed it is told of
        the new one and can observe that; the node, which is new too, will be told anew who publishes.
        """
        self.queue, self.delivered = predecessor.queue, predecessor.delivered
        self.queue.ignore_drops()
        self.deadlines_missed, self._at_start = predecessor.deadlines_missed, predecessor._at_start
        self._topic, self._dispatcher, self._clock = predecessor._topic, predecessor._dispatcher, predecessor._clock
        self._on_failure = on_failure
        self._notices = Notices(predecessor._notices.before, predecessor._notices.lost)
        self._deadline, predecessor._deadline = predecessor._deadline, None
        if self._deadline is not None:
            self._deadline.on_silence = self._miss_deadline
        self.link, predecessor.link = predecessor.link, None
        if self.link is not None:
            self.link.target = self
        predecessor._topic = None
        predecessor.queue = create_queue(predecessor.endpoint.qos.overflow, predecessor.endpoint.qos.depth)
        predecessor.close()
        self._listen()
        if self._topic is not None:
            self._topic.replace_subscription(predecessor, self)

    def turn(self, limit: int) -> int:
        """Hand up to `limit` messages to the plain handler; called by the dispatcher."""
        queue = self.queue
        items: Any = queue.items
        handler: Any = self._handler
        topic: Any = self._topic  # attached, or nothing would have arrived
        handled = 0
        message: M | None = None
        try:
            while items and handled < limit and self._open:
                handled += 1
                message = items.popleft()
                if topic.perishable and (message := self._fresh(message)) is None:  # type: ignore[arg-type]  # just taken
                    continue
                self.delivered += 1
                if (result := handler(message)) is not None:
                    refuse_coroutine(result, self.endpoint.origin)
        except BaseException as error:  # noqa: BLE001  # a handler may raise anything; its node answers for it
            self._failed(error, message)
        if topic is not None and topic.waiting:
            topic.grant()
        if self._open:
            if items:
                self._dispatcher.ready.append(self)  # type: ignore[union-attr]  # attached, or it had no turn
            else:
                queue.idle = True
        return handled

    async def _pump(self, handler: Callable[[M], Any]) -> None:
        """Hand messages to an `async` handler, one at a time, and give the loop its turn between batches."""
        dispatcher: Dispatcher = self._dispatcher  # type: ignore[assignment]  # attached before it is opened
        while self._open:
            if not self.queue.items:
                await self._ring()
            handled, started = 0, dispatcher.now()
            while self._open and (message := self._take()) is not None:
                handled += 1
                try:
                    await handler(message)
                except BaseException as error:
                    if not is_failure(error):
                        raise
                    self._failed(error, message)
                    return
                if handled >= QUANTUM and dispatcher.spent(started, handled):
                    await asyncio.sleep(0)
                    handled, started = 0, dispatcher.now()

    def _refuse_beside_handler(self) -> None:
        if self._handler is not None:
            raise Occupied(f"what {self.endpoint.node} receives on {self.topic} goes to a handler; subscribe twice")

    async def _ring(self) -> None:
        """Wait until something arrives, or the subscription ends."""
        if self._doorbell is not None:
            raise Occupied(f"two tasks wait for {self.topic} in {self.endpoint.node}; subscribe twice instead")
        self._doorbell = asyncio.get_running_loop().create_future()
        self.queue.idle = True
        try:
            await self._doorbell
        finally:
            self._doorbell = None

    def _answer(self) -> None:
        if self._doorbell is not None and not self._doorbell.done():
            self._doorbell.set_result(None)

    def _listen(self) -> None:
        """Choose what an arrival does: a plain handler gets in line, a task that waits is woken."""
        plain = self._handler is not None and not self._is_async
        self.queue.wake = self._get_in_line if plain else self._answer

    def _get_in_line(self) -> None:
        self._dispatcher.schedule(self)  # type: ignore[union-attr]  # attached, or nothing would arrive

    def _watch(self, clock: Clock) -> None:
        self._clock = clock
        limit_s = self.endpoint.qos.deadline_s
        self._deadline = None if limit_s is None else Watch(limit_s, clock, self._miss_deadline, repeat=True)

    def _make_room_and_push(self, item: M | Perishable[M]) -> None:
        if self.queue.full:
            self.discard_expired()
        self.queue.push(item)

    def _on_drop(self, reason: str) -> None:
        if self._clock is not None and reason not in UNWANTED and not self._notices.pending:
            self._notices.pending = True
            self._clock.call_at(self._clock.monotonic_ns(), self._tell_losses)

    def _tell_losses(self) -> None:
        self._notices.pending = False
        self.tell_changes()

    def _miss_deadline(self) -> None:
        self.deadlines_missed += 1
        if self.on_event is not None:
            self.on_event(DeadlineMissed(self.topic, self.deadlines_missed))

    def _failed(self, error: BaseException, message: M | None) -> None:
        self.pause()
        cast("OnFailure", self._on_failure)(error, cast("M", message))

    def __repr__(self) -> str:
        s = self.statistics()
        return f"<Subscription {s.topic} of {s.node}: {s.delivered} delivered, {s.dropped} dropped, {s.queued} queued>"
