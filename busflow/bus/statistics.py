"""Statistics: the current counts of each object of a running graph; reading them changes nothing.

The statistics of subscriptions, servers and clients are accounts, which balance at every moment.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields, replace
from typing import Any, ClassVar, Self, TypeVar, cast

from busflow.bus.qos import Overflow

T = TypeVar("T")
A = TypeVar("A", bound="Account")

_STATED = frozenset({"depth"})
"""Integer fields that are not counts, and so are not added."""
_EARLIEST = frozenset({"since_s"})
"""Times of which a sum has the earlier one."""
EARLY = "early"
"""The reason of `Topic.losses` for a message published before another process had let its publisher in."""
UNSENT = "unsent"
"""The reason of `Topic.losses` for a message that could not leave its process: too large, or not encodable."""
OUTGOING = frozenset({EARLY, UNSENT})
"""The reasons of what was lost to other processes only: each subscription in the publisher's process received it."""
LOST = "lost"
"""The reason of `Topic.losses` for a message that never arrived."""
LINK, END = "link", "end"
"""The reasons why it was lost: its link broke or discarded it, or its process ended before its reader had room."""
UNMATCHED = "unmatched"
"""The reason of a drop for a message published while the subscription's process was not there."""


@dataclass(frozen=True, slots=True)
class Account:
    """The counts of one object of a run, over one or several starts of its node or process."""

    KEY: ClassVar[tuple[str, ...]] = ("node",)
    """The fields in which an object and its successor are equal."""

    def __add__(self, later: Self) -> Self:
        """Return one account of an object and its successor: counts are added, other fields are the successor's."""
        sums: dict[str, Any] = {}
        for each in fields(later):
            before, after = getattr(self, each.name), getattr(later, each.name)
            if isinstance(after, dict):
                sums[each.name] = dict(Counter[str](before) + Counter(cast("dict[str, int]", after)))
            elif isinstance(after, tuple):
                sums[each.name] = added(before, cast("tuple[Account, ...]", after))
            elif type(after) is int and each.name not in _STATED:
                sums[each.name] = before + after
            elif each.name in _EARLIEST:
                sums[each.name] = min(before, after)
        return replace(later, **sums)


def added(*parts: Iterable[A]) -> tuple[A, ...]:
    """Return the accounts of all parts, e.g. of several processes, added up for each object.

    The first account of a key in one part is added to the first in another, the second to the second, and so on.
    """
    found: dict[Hashable, A] = {}
    for part in parts:
        seen = Counter[Hashable]()
        for each in part:
            key = tuple(getattr(each, name) for name in each.KEY)
            seen[key] += 1
            before = found.get((key, seen[key]))
            found[key, seen[key]] = each if before is None else before + each
    return tuple(found.values())


def reasons_text(counts: Mapping[str, int]) -> str:
    """Return counts by reason as text.

    >>> reasons_text({"link": 2, "end": 1})
    '2 link, 1 end'
    """
    return ", ".join(f"{count} {reason}" for reason, count in counts.items())


def from_json(cls: type[T], values: Mapping[str, Any]) -> T:
    """Return an object of a dataclass from its fields; keys of another version of busflow are left out."""
    known = {each.name for each in fields(cls)}  # pyright: ignore[reportArgumentType]  # all of them are dataclasses
    return cls(**{name: value for name, value in values.items() if name in known})


@dataclass(frozen=True, slots=True)
class ServerStatistics(Account):
    """One server's account: `received == served + failed + refused + withdrawn + lost + waiting` at every moment."""

    node: str
    service: str
    depth: int
    received: int
    served: int
    failed: int
    """Requests for which the handler raised."""
    refused: int
    """Requests for which there was no room."""
    withdrawn: int
    """Requests whose caller stopped waiting before the handler began."""
    lost: int
    """Requests that were open when the node ended."""
    waiting: int
    """Requests that are queued or being handled."""


@dataclass(frozen=True, slots=True)
class ClientStatistics(Account):
    """One client's account: `called == answered + failed + cancelled + waiting` at every moment."""

    node: str
    service: str
    called: int
    answered: int
    failed: int
    """Calls that raised for any reason, including timeouts."""
    timed_out: int
    cancelled: int
    """Calls whose caller was cancelled."""
    waiting: int
    errors: dict[str, int] = field(default_factory=dict[str, int])
    """The number of calls per error: ServiceUnavailable, ServiceTimeout, …"""


@dataclass(frozen=True, slots=True)
class SubscriptionStatistics(Account):
    """One line of the ledger: `published == delivered + dropped + queued` at every moment."""

    KEY: ClassVar[tuple[str, ...]] = ("node", "depth")
    node: str
    topic: str
    depth: int
    overflow: Overflow
    published: int
    delivered: int
    dropped: int
    queued: int
    drops: dict[str, int] = field(default_factory=dict[str, int])
    """The number of drops per reason: overflow, expired, superseded, unmatched."""
    deadlines_missed: int = 0
    lost: dict[str, int] = field(default_factory=dict[str, int])
    """The number of messages of other processes that never arrived, per reason: `link` or `end`, of their process."""

    def as_json(self) -> dict[str, Any]:
        """Return the subscription's line in the entry of its topic, with what is lost if anything is."""
        plain = asdict(self)
        if not self.lost:
            del plain["lost"]
        del plain["topic"], plain["deadlines_missed"]
        return plain | {"overflow": self.overflow.value}


@dataclass(frozen=True, slots=True)
class PublisherStatistics(Account):
    """The counts of one publisher, and whether it keeps its deadline and lease."""

    node: str
    topic: str
    published: int
    kept: int
    """Messages that a `transient_local` publisher keeps for late joiners."""
    subscriptions: int
    """The number of subscriptions of its topic in this process."""
    alive: bool
    """False while a `manual_by_topic` publisher is silent beyond its `lease`."""
    deadlines_missed: int
    liveliness_lost: int


@dataclass(frozen=True, slots=True)
class TopicStatistics(Account):
    """The counts of one topic, and of each of its present and past subscriptions."""

    KEY: ClassVar[tuple[str, ...]] = ("topic",)
    topic: str
    type: str
    published: int
    arrived: int = 0
    """The number of published messages that came from other processes; 0 in the report of a whole run."""
    since_s: float = 0.0
    """The time of its first publisher, in seconds of the run."""
    losses: dict[str, int] = field(default_factory=dict[str, int])
    """Messages published in other processes or threads that did not become a message here, by reason."""
    subscriptions: tuple[SubscriptionStatistics, ...] = ()
    publishers: tuple[PublisherStatistics, ...] = ()
    """The present publishers; messages of past ones are counted in `published`."""

    @property
    def name(self) -> str:
        """The name of the topic."""
        return self.topic

    def as_json(self) -> dict[str, Any]:
        """Return the topic's entry in a report."""
        return {
            "name": self.topic,
            "type": self.type,
            "published": self.published,
            "arrived": self.arrived,
            "since_s": self.since_s,
            "losses": self.losses,
            "subscriptions": [each.as_json() for each in self.subscriptions],
        }

    @classmethod
    def from_json(cls, entry: Mapping[str, Any]) -> TopicStatistics:
        """Return the counts of an entry in a report, as `as_json` makes it."""
        own = {"topic": entry["name"]}
        lines = tuple(
            from_json(SubscriptionStatistics, {**each, **own, "overflow": Overflow(each["overflow"])})
            for each in entry["subscriptions"]
        )
        return from_json(cls, {**entry, **own, "subscriptions": lines})

    @classmethod
    def of_run(cls, parts: Sequence[TopicStatistics]) -> TopicStatistics:
        """Return a topic's counts in a run, of its counts in each process: a message is published in one process alone.

        Some messages are in no publisher's report: its process was killed before it reported them, or a program outside
        of the run published them. The process that received the most messages gives a lower bound.
        """
        own = (replace(each, published=each.published - each.arrived, arrived=0) for each in parts)
        (found,) = added(*([each] for each in own))
        return replace(found, published=max(found.published, *(each.published for each in parts)))


@dataclass(frozen=True, slots=True)
class ServiceStatistics(Account):
    """The accounts of one service: one per present or past server or client node of this process."""

    KEY: ClassVar[tuple[str, ...]] = ("service",)
    service: str
    type: str
    servers: tuple[ServerStatistics, ...]
    clients: tuple[ClientStatistics, ...]

    @property
    def name(self) -> str:
        """The name of the service."""
        return self.service

    def as_json(self) -> dict[str, Any]:
        """Return the service's entry in a report."""
        plain = asdict(self)
        return {"name": plain.pop("service"), **plain}


@dataclass(frozen=True, slots=True)
class TimerStatistics(Account):
    """One timer's line of the report; times in seconds of the run's clock."""

    KEY: ClassVar[tuple[str, ...]] = ("node", "name")
    node: str
    name: str
    period_s: float
    fired: int
    missed: int
    lateness_p50_s: float | None
    lateness_p99_s: float | None


@dataclass(frozen=True, slots=True)
class InboxStatistics:
    """The counts of messages from other threads for the event loop."""

    taken: int
    dropped: int
    """Messages dropped because the inbox was full or closed."""
    refused: int
    """Messages for which an `overflow: block` subscription had no room, or whose publisher had left."""
    waiting: int


@dataclass(frozen=True, slots=True)
class DispatcherStatistics:
    """The load of the event loop by messages and requests."""

    ready: int
    """The number of subscriptions and servers that wait for their turn."""
    quantum: int
    """Messages per turn; fewer while handlers are slow."""


@dataclass(frozen=True, slots=True)
class BusStatistics:
    """The counts of one bus; topics and services are sorted by name."""

    topics: tuple[TopicStatistics, ...]
    services: tuple[ServiceStatistics, ...]
    inbox: InboxStatistics
    dispatcher: DispatcherStatistics


@dataclass(frozen=True, slots=True)
class NodeStatistics:
    """The counts of one node's endpoints, timers, tasks and parameter changes."""

    node: str
    publishers: tuple[PublisherStatistics, ...]
    subscriptions: tuple[SubscriptionStatistics, ...]
    servers: tuple[ServerStatistics, ...]
    clients: tuple[ClientStatistics, ...]
    timers: tuple[TimerStatistics, ...]
    tasks: int
    """The number of its tasks that have not ended."""
    parameters_set: int
    """The number of parameter changes while it ran."""
