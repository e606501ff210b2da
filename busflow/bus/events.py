"""Events: what can happen to an endpoint besides messages; a node hears of them with `@on_event(topic)`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Event:
    """Something happened to one end of a topic."""

    topic: str
    """The topic's final name."""


@dataclass(frozen=True, slots=True)
class DeadlineMissed(Event):
    """No message for longer than the `deadline`; told once per deadline for as long as the silence lasts.

    A publisher's node hears that it has not published, a subscription's node that nothing has arrived.
    """

    count: int
    """How often it has been missed by now."""


@dataclass(frozen=True, slots=True)
class LivelinessLost(Event):
    """A `manual_by_topic` publisher of this node has been silent for longer than its `lease`."""

    count: int
    """How often it has been lost by now."""


@dataclass(frozen=True, slots=True)
class LivelinessChanged(Event):
    """A publisher of a topic that this node receives came to life, fell silent beyond its `lease`, or left."""

    alive: int
    """How many publishers of the topic are alive."""
    not_alive: int
    """How many are there, but silent beyond their lease."""


@dataclass(frozen=True, slots=True)
class PublisherMatched(Event):
    """Subscriptions of a topic that this node publishes came or left; those that were there first are told of, too."""

    total: int
    """How many there ever were while this node published."""
    total_change: int
    current: int
    """How many there are."""
    current_change: int


@dataclass(frozen=True, slots=True)
class SubscriptionMatched(Event):
    """Publishers of a topic that this node receives came or left; those that were there first are told of, too."""

    total: int
    """How many there ever were while this node received."""
    total_change: int
    current: int
    """How many there are."""
    current_change: int


@dataclass(frozen=True, slots=True)
class MessageLost(Event):
    """Messages for this node were lost: its queue was full, or they did not arrive.

    Not told of are those that it did not want any more: expired ones, and those that a newer one has superseded.
    """

    total: int
    """How many were lost by now."""
    total_change: int
    """How many of them since it was last told."""


UNWANTED = frozenset({"expired", "superseded"})
"""Reasons for which a message is dropped that nobody misses."""


@dataclass(slots=True)
class Notices:
    """What a node knows already of one end of a topic, so that each change makes one event.

    Pure: states are compared, not occurrences collected, so a node that begins to listen late learns what it missed.
    """

    before: int = 0
    """How many ends of the other kind had come and left before this one came."""
    lost: int = 0
    pending: bool = False
    """Whether losses are going to be told."""
    _matched: tuple[int, int] = (0, 0)
    _alive: tuple[int, int] = (0, 0)

    def matching(
        self, kind: type[PublisherMatched | SubscriptionMatched], topic: str, come: int, current: int
    ) -> Iterator[Event]:
        """News of the ends of the other kind, of which so many have come by now and so many are there."""
        (last_total, last_current), self._matched = self._matched, (come - self.before, current)
        total = come - self.before
        if (last_total, last_current) != self._matched:
            yield kind(topic, total, total - last_total, current, current - last_current)

    def liveliness(self, topic: str, alive: int, not_alive: int) -> Iterator[Event]:
        """News of how many publishers are alive."""
        last, self._alive = self._alive, (alive, not_alive)
        if last != self._alive:
            yield LivelinessChanged(topic, alive, not_alive)

    def losses(self, topic: str, drops: Counter[str]) -> Iterator[Event]:
        """News of messages that were lost."""
        last, self.lost = self.lost, sum(count for reason, count in drops.items() if reason not in UNWANTED)
        if last != self.lost:
            yield MessageLost(topic, self.lost, self.lost - last)
