"""Topic: a name, its type, its current publishers and subscriptions, and the senders that wait for room.

A publish calls a tuple of functions, `pushes`, one after the other: the `push` methods of the subscriptions, and taps
(functions that `Bus.tap` adds to see every message). The tuple is rebuilt when an endpoint or tap comes or goes. Every
counter has one owner: a publisher counts its published messages, a queue its drops, a subscription its deliveries.
"""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Callable
from typing import Any, Generic, Protocol, TypeVar

from busflow.bus.delivery import DeliverySource
from busflow.bus.endpoint import Endpoint
from busflow.bus.events import Event
from busflow.bus.expiry import Perishable, fresh, next_expiry_ns
from busflow.bus.qos import Overflow
from busflow.bus.statistics import LOST, PublisherStatistics, SubscriptionStatistics, TopicStatistics
from busflow.clock import NS_PER_S, Clock
from busflow.errors import SendTimeout
from busflow.interfaces.message import Message, type_name

M = TypeVar("M", bound=Message)
E = TypeVar("E", bound="TopicEndpoint")


class TopicEndpoint(Protocol):
    """An endpoint as its topic sees it: the members that the topic uses."""

    endpoint: Endpoint
    on_event: Callable[[Event], None] | None

    def report_changes(self) -> None: ...  # noqa: D102  # documented in Publisher and Subscription


class TopicPublisher(TopicEndpoint, Protocol):
    """A publisher as its topic sees it."""

    published: int
    alive: bool

    @property
    def perishable(self) -> bool: ...  # noqa: D102  # as above
    @property
    def history(self) -> tuple[tuple[int, Any], ...]: ...  # noqa: D102  # as above
    def adjust(self) -> None: ...  # noqa: D102  # as above
    def statistics(self) -> PublisherStatistics: ...  # noqa: D102  # as above


class Receiver(TopicEndpoint, Protocol):
    """A subscription as its topic sees it."""

    idle: bool
    items: deque[Any]

    @property
    def queued(self) -> int: ...  # noqa: D102  # as above
    @property
    def full(self) -> bool: ...  # noqa: D102  # as above
    @property
    def pushes(self) -> tuple[Callable[[Any], None], ...]: ...  # noqa: D102  # as above
    @property
    def keeps_newest(self) -> bool: ...  # noqa: D102  # as above
    def count_overflow(self, count: int) -> None: ...  # noqa: D102  # as above
    def count_lost(self, reason: str, count: int) -> None: ...  # noqa: D102  # as above
    def wake(self) -> None: ...  # noqa: D102  # as above
    def statistics(self) -> SubscriptionStatistics: ...  # noqa: D102  # as above


class Topic(DeliverySource, Generic[M]):
    """A name, its type, and its current publishers and subscriptions."""

    __slots__ = (
        "_arrived", "_expiry", "_gone", "_on_leave", "_retired", "blocking", "clock", "earlier", "losses", "name",
        "publishers", "publishers_added", "pushes", "recent", "since_ns", "subscriptions", "subscriptions_added",
        "taps", "type",
    )  # fmt: skip

    def __init__(
        self,
        name: str,
        message_type: type[M],
        clock: Clock,
        on_leave: Callable[[TopicEndpoint], object],
    ) -> None:
        """Create a topic without endpoints; `on_leave` is called with every endpoint that leaves."""
        super().__init__()
        self.name: str = name
        self.clock: Clock = clock
        self.type: type[M] = message_type
        self.publishers: list[TopicPublisher] = []
        self.subscriptions: list[Receiver] = []
        self.pushes: tuple[Callable[[Any], None], ...] = ()
        self.blocking: tuple[Receiver, ...] = ()
        self.taps: list[Callable[[M], None]] = []
        self.recent: deque[M | Perishable[M]] | None = None
        """The last messages, if `Bus.keep_recent` asked for them; a tap could raise an exception, an append cannot."""
        self.publishers_added: int = 0
        self.since_ns: int = 0
        """Monotonic time at which the first publisher came, in ns; it may be before the run begins."""
        self.subscriptions_added: int = 0
        self._gone: dict[Endpoint, SubscriptionStatistics] = {}
        self.losses: Counter[str] = Counter()
        """Messages that did not cross into or out of this process, or the bus's thread, by reason.

        From other processes: `lost` on the way, `malformed`, `refused` by a full blocking queue, `incompatible`,
        `expired`, `unsigned` (sent with no publisher known here). From other threads: `inbox_dropped` and
        `inbox_refused`. To other processes: `early` (published before another process that receives the topic had
        admitted the publisher) and `unsent` (too large, or not encodable).
        """
        self.earlier: int = 0
        """Messages of remote publishers that are in no `published`: they came because late joiners asked for them."""
        self._retired = 0
        """The number of messages published by publishers that have left."""
        self._arrived = 0
        """The same for remote publishers alone."""
        self._on_leave = on_leave
        self._expiry: asyncio.TimerHandle | None = None

    @property
    def published(self) -> int:
        """The number of messages ever published here."""
        return self._retired + sum(publisher.published for publisher in self.publishers)

    @property
    def arrived(self) -> int:
        """The number of published messages that came from other processes."""
        return self._arrived + sum(each.published for each in self.publishers if each.endpoint.remote)

    def statistics(self) -> TopicStatistics:
        """Return the current counts of the topic and its endpoints; those of one that left and came again are added."""
        gone = dict(self._gone)
        lines = [(gone.pop(each.endpoint, None), each.statistics()) for each in self.subscriptions]
        present = [line if before is None else before + line for before, line in lines]
        return TopicStatistics(
            topic=self.name,
            type=type_name(self.type),
            published=self.published + self.earlier,
            arrived=self.arrived + self.earlier,
            since_s=max(0, self.since_ns - self.clock.monotonic_ns() + self.clock.elapsed_ns()) / NS_PER_S,
            losses=dict(self.losses),
            subscriptions=(*present, *gone.values()),
            publishers=tuple(each.statistics() for each in self.publishers),
        )

    @property
    def gone(self) -> tuple[SubscriptionStatistics, ...]:
        """The statistics of subscriptions that have left, added up where their endpoints are equal."""
        return tuple(self._gone.values())

    def kept(self) -> list[M | Perishable[M]]:
        """Return the unexpired messages that transient_local publishers keep for late joiners, in publishing order."""
        kept = sorted((entry for each in self.publishers for entry in each.history), key=lambda entry: entry[0])
        return [item for _, item in kept if fresh(item, self.clock) is not None]

    @property
    def keeps_newest(self) -> int | None:
        """The number of newest messages that are kept here, whatever comes before them; None if all must come in."""
        if self.taps or not all(each.keeps_newest for each in self.subscriptions):
            return None
        recent = 0 if self.recent is None else self.recent.maxlen or 0
        return max((recent, *(each.endpoint.qos.depth for each in self.subscriptions)))

    def count_overflow(self, publisher: TopicPublisher, count: int) -> None:
        """Count messages of a remote publisher that were dropped before they came into the queues."""
        publisher.published += count
        for each in self.subscriptions:
            each.count_overflow(count)

    def count_lost(self, reason: str, count: int) -> None:
        """Count messages of other processes that never arrived, here and at each reader; negative: that came late."""
        self.losses[LOST] += count
        if not self.losses[LOST]:
            del self.losses[LOST]
        for each in self.subscriptions:
            each.count_lost(reason, count)

    def first_full(self) -> Receiver | None:
        """Return the first `overflow: block` subscription without room, if any."""
        for subscription in self.blocking:
            if subscription.full:
                return subscription
        return None

    async def wait_for_room(self) -> None:
        """Wait behind earlier senders for room in every blocking queue; the caller must publish before it awaits."""
        turn = asyncio.get_running_loop().create_future()
        self.waiting.append(turn)
        full = [each for each in self.blocking if each.full] or self.blocking
        limit_s = min((each.endpoint.qos.block_timeout_s for each in full), default=None)
        granted = False
        try:
            async with asyncio.timeout(limit_s):
                self.grant()  # without room it also schedules a check for when a message expires
                await turn
                while self.first_full() is not None:  # a late joiner may start with a queue full of kept messages
                    self.waiting[0] = turn = asyncio.get_running_loop().create_future()
                    self.grant()
                    await turn
            granted = True
        except TimeoutError:
            slow = ", ".join(each.endpoint.node for each in self.blocking if each.full)
            raise SendTimeout(
                f"no room on {self.name} within {limit_s} s (overflow: block): {slow or 'an earlier send'} is too "
                "slow; raise the subscription's depth or block_timeout, or choose overflow: drop_oldest"
            ) from None
        finally:
            self.waiting.remove(turn)
            if not granted:  # the next sender must not wait for the turn of one that gave up
                self.grant()
            if not self.waiting:
                self._check_room_at(None)
                self._adjust()

    def grant(self) -> None:
        """Wake the first waiting sender when there is room for it."""
        if not self.waiting or self.waiting[0].done():
            return
        full = self.first_full()
        if full is None:
            self.waiting[0].set_result(None)
        elif self.perishable:
            self._check_room_at(next_expiry_ns(full.items))

    def _check_room_at(self, due_ns: int | None) -> None:
        """Schedule the next check for room, when a queued message expires; None cancels it."""
        if self._expiry is not None:
            self._expiry.cancel()
        self._expiry = None if due_ns is None else self.clock.call_at(due_ns, self.grant)

    def wake(self) -> None:
        """Wake the idle subscriptions that have a message now, in the order in which they attached.

        The usual publish calls this only while `idle` is True: for busy subscriptions it pays just that one check.
        """
        idle = False
        for each in self.subscriptions:
            if each.idle:
                if each.items:
                    each.wake()
                else:
                    idle = True
        self.idle = idle

    def rebuild(self) -> None:
        """Rebuild the tuple that a publish walks from the current endpoints and taps."""
        # `perishable` stays True, and every delivery checks for expired messages: some may be queued even after their
        # publisher has left.
        self.perishable: bool = self.perishable or any(each.perishable for each in self.publishers)
        recent = () if self.recent is None else (self.recent.append,)
        taps = map(self._guarded, self.taps)
        self.pushes = (*recent, *taps, *(push for each in self.subscriptions for push in each.pushes))
        self.blocking = tuple(each for each in self.subscriptions if each.endpoint.qos.overflow is Overflow.BLOCK)
        self._adjust()
        self.report_changes()
        self.grant()

    def _adjust(self) -> None:
        for publisher in self.publishers:
            publisher.adjust()

    def _guarded(self, tap: Callable[[M], None]) -> Callable[[M | Perishable[M]], None]:
        """Wrap a tap: it gets the message itself; an exception is logged and removes the tap, delivery goes on."""

        def call(item: M | Perishable[M]) -> None:
            message: Any = item.message if type(item) is Perishable else item
            try:
                tap(message)
            except Exception as error:  # noqa: BLE001  # logged below; not the publisher's fault
                if tap in self.taps:
                    self.taps.remove(tap)
                    self.rebuild()
                text = f"a tap of {self.name} raised and was removed"
                asyncio.get_running_loop().call_exception_handler({"message": text, "exception": error})

        return call

    def liveliness(self) -> tuple[int, int]:
        """Return how many publishers are alive, and how many are present but silent for longer than their lease."""
        alive = sum(publisher.alive for publisher in self.publishers)
        return alive, len(self.publishers) - alive

    def report_changes(self) -> None:
        """Let endpoints with an event handler report what changed: counterparts, their liveliness, or losses."""
        for end in (*self.publishers, *self.subscriptions):
            if end.on_event is not None:
                end.report_changes()

    # Attaching and detaching endpoints.

    def add_publisher(self, publisher: TopicPublisher) -> None:
        """Add a publisher; the first one sets `since_ns`."""
        if not self.publishers_added:
            self.since_ns = self.clock.monotonic_ns()
        self.publishers_added += 1
        self.publishers.append(publisher)
        self.rebuild()

    def add_subscription(self, subscription: Receiver) -> None:
        """Add a subscription that has already received its kept messages."""
        self.subscriptions_added += 1
        self.subscriptions.append(subscription)
        self.rebuild()

    def remove_publisher(self, publisher: TopicPublisher) -> None:
        """Remove a publisher; its published messages stay counted."""
        self.publishers.remove(publisher)
        self._retired += publisher.published
        self._arrived += publisher.published if publisher.endpoint.remote else 0
        self._notify_left(publisher)

    def remove_subscription(self, subscription: Receiver) -> None:
        """Remove a subscription; its statistics stay."""
        self.subscriptions.remove(subscription)
        line, before = subscription.statistics(), self._gone.get(subscription.endpoint)
        self._gone[subscription.endpoint] = line if before is None else before + line
        self._notify_left(subscription)

    def replace(self, ends: list[E], old: E, new: E) -> None:
        """Replace a publisher or subscription by its successor, which continues the counts."""
        ends[ends.index(old)] = new
        self._notify_left(old)

    def _notify_left(self, end: TopicEndpoint) -> None:
        self.rebuild()
        self._on_leave(end)
