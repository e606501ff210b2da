"""Statistics: what each object of a running graph has counted so far; asking for them changes nothing.

Those of the ends of topics and services are accounts, which balance at every moment.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, fields, replace
from typing import Any, Self, cast

from busflow.bus.qos import Overflow

_STATED = frozenset({"depth"})
"""Numbers that are no counts."""


@dataclass(frozen=True, slots=True)
class Account:
    """What was counted at one end, over one life of its node or several."""

    def __add__(self, later: Self) -> Self:
        """One account of two ends that were each other's successors: counts are added, all else is the later one's."""
        sums: dict[str, Any] = {}
        for each in fields(later):
            before, after = getattr(self, each.name), getattr(later, each.name)
            if isinstance(after, dict):
                sums[each.name] = dict(Counter[str](before) + Counter(cast("dict[str, int]", after)))
            elif isinstance(after, int) and each.name not in _STATED:
                sums[each.name] = before + after
        return replace(later, **sums)


@dataclass(frozen=True, slots=True)
class ServerStatistics(Account):
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


@dataclass(frozen=True, slots=True)
class ClientStatistics(Account):
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


@dataclass(frozen=True, slots=True)
class SubscriptionStatistics(Account):
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


@dataclass(frozen=True, slots=True)
class PublisherStatistics:
    """What one publisher has published, and what became of its promises."""

    node: str
    topic: str
    published: int
    kept: int
    """Messages that wait for late joiners, of a `transient_local` publisher."""
    subscriptions: int
    """How many receive here what it publishes."""
    alive: bool
    """Whether it has spoken within its `lease`, if it has to."""
    deadlines_missed: int
    liveliness_lost: int


@dataclass(frozen=True, slots=True)
class TopicStatistics:
    """What went over one topic, and the account of each subscription that it has or had."""

    topic: str
    published: int
    arrived: int
    """How many of them came from another process."""
    losses: dict[str, int]
    """What was published in another process and became no message here, by reason."""
    publishers: tuple[PublisherStatistics, ...]
    """Of those that are there; what the others published is counted above."""
    subscriptions: tuple[SubscriptionStatistics, ...]


@dataclass(frozen=True, slots=True)
class ServiceStatistics:
    """The accounts of one service: one for each node of this process that answers or answered, asks or asked."""

    service: str
    servers: tuple[ServerStatistics, ...]
    clients: tuple[ClientStatistics, ...]


@dataclass(frozen=True, slots=True)
class TimerStatistics:
    """One timer's line of the report; times in seconds of the run's clock."""

    node: str
    name: str
    period_s: float
    fired: int
    missed: int
    lateness_p50_s: float | None
    lateness_p99_s: float | None


@dataclass(frozen=True, slots=True)
class InboxStatistics:
    """What other threads handed to the event loop."""

    taken: int
    dropped: int
    """They found the inbox full, or came after the end."""
    refused: int
    """An `overflow: block` subscription had no room for them."""
    waiting: int


@dataclass(frozen=True, slots=True)
class DispatcherStatistics:
    """How busy the event loop is with messages and requests."""

    ready: int
    """Subscriptions and servers that wait for their turn."""
    quantum: int
    """Messages of a turn: fewer while handlers are slow."""


@dataclass(frozen=True, slots=True)
class BusStatistics:
    """All that crosses one bus; topics and services by name."""

    topics: tuple[TopicStatistics, ...]
    services: tuple[ServiceStatistics, ...]
    inbox: InboxStatistics
    dispatcher: DispatcherStatistics


@dataclass(frozen=True, slots=True)
class NodeStatistics:
    """What one node has on the bus, and runs."""

    node: str
    publishers: tuple[PublisherStatistics, ...]
    subscriptions: tuple[SubscriptionStatistics, ...]
    servers: tuple[ServerStatistics, ...]
    clients: tuple[ClientStatistics, ...]
    timers: tuple[TimerStatistics, ...]
    tasks: int
    """Those of its tasks that have not ended."""
    parameters_set: int
    """How often parameters of it were changed while it ran."""
