"""Topic: a name, its type, who is on both ends of it now, and who waits for room.

The tuple of `push` methods that a publish walks is rebuilt when somebody comes or goes, never searched. Every counter
has one owner: a publisher counts what it published, a queue what it dropped, a subscription what it handed over.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from busflow.errors import SendTimeout
from busflow.limits import Perishable, fresh
from busflow.message import Message
from busflow.publishers import Publisher
from busflow.qos import Overflow
from busflow.subscriptions import Subscription, SubscriptionStatistics

if TYPE_CHECKING:
    from busflow.clock import Clock

M = TypeVar("M", bound=Message)


class Topic(Generic[M]):
    """A name, its type, and who is on both ends of it now."""

    __slots__ = (
        "_on_leave", "_retired", "blocking", "clock", "gone", "name", "perishable", "publishers", "pushes",
        "subscriptions", "taps", "type", "waiting",
    )  # fmt: skip

    def __init__(
        self,
        name: str,
        message_type: type[M],
        clock: Clock,
        on_leave: Sequence[Callable[[Publisher[Any] | Subscription[Any]], None]] = (),
    ) -> None:
        """A topic on which nobody is yet; `on_leave` hear of each end that leaves it."""
        self.name = name
        self.clock = clock
        self.perishable = False
        self.type = message_type
        self.publishers: list[Publisher[M]] = []
        self.subscriptions: list[Subscription[M]] = []
        self.pushes: tuple[Callable[[Any], None], ...] = ()
        self.blocking: tuple[Subscription[M], ...] = ()
        self.taps: list[Callable[[M], None]] = []
        self.waiting: deque[asyncio.Future[None]] = deque()
        self.gone: list[SubscriptionStatistics] = []
        """The last account of each subscription that has left."""
        self._retired = 0
        self._on_leave = on_leave

    @property
    def published(self) -> int:
        """How many messages were ever published here."""
        return self._retired + sum(publisher.published for publisher in self.publishers)

    def kept(self) -> list[M | Perishable[M]]:
        """What the transient_local publishers keep for late joiners and has not expired, in the order of publishing."""
        kept = sorted((entry for each in self.publishers for entry in each.history), key=lambda entry: entry[0])
        return [item for _, item in kept if fresh(item, self.clock) is not None]

    def first_full(self) -> Subscription[M] | None:
        """The first `overflow: block` subscription without room."""
        for subscription in self.blocking:
            if subscription.full:
                return subscription
        return None

    async def wait_for_room(self) -> None:
        """Wait behind earlier senders until every blocking queue has room; then publish before awaiting again."""
        turn = asyncio.get_running_loop().create_future()
        self.waiting.append(turn)
        full = [each for each in self.blocking if each.full] or self.blocking
        limit_s = min((each.endpoint.qos.block_timeout_s for each in full), default=None)
        granted = False
        try:
            async with asyncio.timeout(limit_s):
                await turn
                while self.first_full() is not None:  # a late joiner's queue may have come full of what was kept
                    self.waiting[0] = turn = asyncio.get_running_loop().create_future()
                    await turn
            granted = True
        except TimeoutError:
            slow = ", ".join(each.endpoint.node for each in self.blocking if each.full)
            raise SendTimeout(
                f"no room on {self.name} within {limit_s} s (overflow: block): {slow or 'an earlier send'} is too "
                "slow; raise its depth or block_timeout, or choose overflow: drop_oldest"
            ) from None
        finally:
            self.waiting.remove(turn)
            if not granted:  # whoever leaves the line must not leave the next one standing there for ever
                self.grant()
            if not self.waiting:
                self._adjust()

    def grant(self) -> None:
        """Wake the first waiting sender when there is room for it."""
        if self.waiting and self.first_full() is None and not self.waiting[0].done():
            self.waiting[0].set_result(None)

    def rebuild(self) -> None:
        """Bring the tuple that a publish walks up to date with who is here."""
        # Once a message that can expire may wait somewhere, every taking looks, also after its publisher has gone.
        self.perishable = self.perishable or any(each.perishable for each in self.publishers)
        taps = [self._opened(tap) for tap in self.taps] if self.perishable else self.taps
        self.pushes = (*taps, *(push for each in self.subscriptions for push in each.pushes))
        self.blocking = tuple(each for each in self.subscriptions if each.endpoint.qos.overflow is Overflow.BLOCK)
        self._adjust()
        self.tell_liveliness()
        self.grant()

    def _adjust(self) -> None:
        for publisher in self.publishers:
            publisher.adjust()

    @staticmethod
    def _opened(tap: Callable[[M], None]) -> Callable[[M | Perishable[M]], None]:
        """A tap is given the message itself, also of a publisher whose messages expire."""
        return lambda item: tap(cast("M", item.message if isinstance(item, Perishable) else item))

    def tell_liveliness(self) -> None:
        """Let the subscriptions know how many publishers are alive, if that has changed."""
        alive = sum(publisher.alive for publisher in self.publishers)
        for subscription in self.subscriptions:
            subscription.notice_liveliness(alive, len(self.publishers) - alive)

    def forget_publisher(self, publisher: Publisher[M]) -> None:
        """A publisher leaves; what it published stays counted."""
        self.publishers.remove(publisher)
        self._retired += publisher.published
        self.rebuild()
        for hear in self._on_leave:
            hear(publisher)

    def forget_subscription(self, subscription: Subscription[M]) -> None:
        """A subscription leaves; its account stays."""
        self.subscriptions.remove(subscription)
        self.gone.append(subscription.statistics())
        self.rebuild()
        for hear in self._on_leave:
            hear(subscription)

    def replace_subscription(self, old: Subscription[M], new: Subscription[M]) -> None:
        """A subscription takes over another one's place."""
        self.subscriptions[self.subscriptions.index(old)] = new
        self.rebuild()
