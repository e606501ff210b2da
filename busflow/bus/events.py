"""Events: changes of an endpoint other than messages; a node receives them with `@on_event(topic)`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Event:
    """Base of the events of one endpoint of a topic."""

    topic: str
    """The topic's final name."""


@dataclass(frozen=True, slots=True)
class DeadlineMissed(Event):
    """No message came for longer than the `deadline`; sent once per deadline while the silence lasts.

    A publisher's node gets it when it has not published, a subscription's node when nothing has arrived.
    """

    count: int
    """The number of missed deadlines so far."""


@dataclass(frozen=True, slots=True)
class LivelinessLost(Event):
    """A `manual_by_topic` publisher of this node has been silent for longer than its `lease`."""

    count: int
    """The number of losses so far."""


@dataclass(frozen=True, slots=True)
class LivelinessChanged(Event):
    """A publisher of a topic that this node receives became alive, was silent beyond its `lease`, or left."""

    alive: int
    """The number of publishers of the topic that are alive."""
    not_alive: int
    """The number of publishers that are silent beyond their lease."""


@dataclass(frozen=True, slots=True)
class PublisherMatched(Event):
    """Subscriptions of a topic that this node publishes came or left; those already present are reported too."""

    total: int
    """The number of subscriptions that ever existed while this node published."""
    total_change: int
    current: int
    """The number of them now."""
    current_change: int


@dataclass(frozen=True, slots=True)
class SubscriptionMatched(Event):
    """Publishers of a topic that this node receives came or left; those already present are reported too."""

    total: int
    """The number of publishers that ever existed while this node received."""
    total_change: int
    current: int
    """The number of them now."""
    current_change: int


@dataclass(frozen=True, slots=True)
class MessageLost(Event):
    """Messages for this node were lost: its queue was full, or they did not arrive.

    Messages that were no longer wanted do not count: expired ones, and those superseded by a newer one.
    """

    total: int
    """The number of lost messages so far."""
    total_change: int
    """The number lost since the last event."""


UNWANTED = frozenset({"expired", "superseded"})
"""Reasons for dropping a message that do not count as a loss."""


@dataclass(slots=True)
class Notices:
    """The state of one endpoint that its node already knows, so that each change makes one event.

    Pure: it compares states and does not collect occurrences, so a node that starts to listen late misses nothing.
    """

    before: int = 0
    """The number of matching endpoints that had come and left before this one came."""
    lost: int = 0
    pending: bool = False
    """Whether an event for losses is scheduled."""
    _matched: tuple[int, int] = (0, 0)
    _alive: tuple[int, int] = (0, 0)

    def matching(
        self, kind: type[PublisherMatched | SubscriptionMatched], topic: str, come: int, current: int
    ) -> Iterator[Event]:
        """Yield an event if the matching endpoints changed: `come` ever attached, `current` are attached now."""
        (last_total, last_current), self._matched = self._matched, (come - self.before, current)
        total = come - self.before
        if (last_total, last_current) != self._matched:
            yield kind(topic, total, total - last_total, current, current - last_current)

    def liveliness(self, topic: str, alive: int, not_alive: int) -> Iterator[Event]:
        """Yield an event if the number of live publishers changed."""
        last, self._alive = self._alive, (alive, not_alive)
        if last != self._alive:
            yield LivelinessChanged(topic, alive, not_alive)

    def losses(self, topic: str, drops: Counter[str]) -> Iterator[Event]:
        """Yield an event if more messages were lost."""
        last, self.lost = self.lost, sum(count for reason, count in drops.items() if reason not in UNWANTED)
        if last != self.lost:
            yield MessageLost(topic, self.lost, self.lost - last)
