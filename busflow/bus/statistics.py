"""Statistics: the account of each end of a topic or a service, which balances at every moment."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

from busflow.bus.qos import Overflow


@dataclass(frozen=True, slots=True)
class ServerStatistics:
    """One server's account: `received == served + failed + refused + withdrawn + lost + waiting` at every moment."""

    node: str
    service: str
    depth: int
    received: int
    served: int
    failed: int
    """The handler raised."""
    refused: int
    """There was no room for it."""
    withdrawn: int
    """Nobody waited for the answer any more before the handler began."""
    lost: int
    """The node ended first."""
    waiting: int
    """Queued, or with the handler now."""

    def __add__(self, later: ServerStatistics) -> ServerStatistics:
        """One account of two servers that a node had one after the other."""
        return ServerStatistics(
            node=later.node,
            service=later.service,
            depth=later.depth,
            received=self.received + later.received,
            served=self.served + later.served,
            failed=self.failed + later.failed,
            refused=self.refused + later.refused,
            withdrawn=self.withdrawn + later.withdrawn,
            lost=self.lost + later.lost,
            waiting=self.waiting + later.waiting,
        )


@dataclass(frozen=True, slots=True)
class ClientStatistics:
    """One client's account: `called == answered + failed + cancelled + waiting` at every moment."""

    node: str
    service: str
    called: int
    answered: int
    failed: int
    """Calls that raised, for whatever reason, timeouts among them."""
    timed_out: int
    cancelled: int
    """Calls whose caller was cancelled."""
    waiting: int
    errors: dict[str, int] = field(default_factory=dict[str, int])
    """How many calls raised what: ServiceUnavailable, ServiceTimeout, …"""

    def __add__(self, other: ClientStatistics) -> ClientStatistics:
        """One account of two clients of a node."""
        return ClientStatistics(
            node=self.node,
            service=self.service,
            called=self.called + other.called,
            answered=self.answered + other.answered,
            failed=self.failed + other.failed,
            timed_out=self.timed_out + other.timed_out,
            cancelled=self.cancelled + other.cancelled,
            waiting=self.waiting + other.waiting,
            errors=dict(Counter(self.errors) + Counter(other.errors)),
        )


@dataclass(frozen=True, slots=True)
class SubscriptionStatistics:
    """One line of the ledger: `published == delivered + dropped + queued` at every moment."""

    node: str
    topic: str
    depth: int
    overflow: Overflow
    published: int
    delivered: int
    dropped: int
    queued: int
    drops: dict[str, int] = field(default_factory=dict[str, int])
    """How many were dropped for which reason: overflow, expired, superseded."""
    deadlines_missed: int = 0

    def merged(self, later: SubscriptionStatistics) -> SubscriptionStatistics:
        """One line for two subscriptions that were each other's successors, which balances when both do."""
        return replace(
            later,
            published=self.published + later.published,
            delivered=self.delivered + later.delivered,
            dropped=self.dropped + later.dropped,
            queued=self.queued + later.queued,
            drops=dict(Counter(self.drops) + Counter(later.drops)),
            deadlines_missed=self.deadlines_missed + later.deadlines_missed,
        )
