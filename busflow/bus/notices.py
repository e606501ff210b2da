"""Notices: what a node has been told of one of its ends besides messages, so that it is told of each change once.

Pure: states are compared, not occurrences collected, so a node that begins to listen late is told what it missed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

from busflow.bus.events import Event, LivelinessChanged, MessageLost, PublisherMatched, SubscriptionMatched

UNWANTED = frozenset({"expired", "superseded"})
"""Reasons for which a message is dropped that nobody misses."""


@dataclass(slots=True)
class Notices:
    """What was told of one end of a topic."""

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
        (told_total, told_current), self._matched = self._matched, (come - self.before, current)
        total = come - self.before
        if (told_total, told_current) != self._matched:
            yield kind(topic, total, total - told_total, current, current - told_current)

    def liveliness(self, topic: str, alive: int, not_alive: int) -> Iterator[Event]:
        """News of how many publishers are alive."""
        told, self._alive = self._alive, (alive, not_alive)
        if told != self._alive:
            yield LivelinessChanged(topic, alive, not_alive)

    def losses(self, topic: str, drops: Counter[str]) -> Iterator[Event]:
        """News of messages that were lost."""
        told, self.lost = self.lost, sum(count for reason, count in drops.items() if reason not in UNWANTED)
        if told != self.lost:
            yield MessageLost(topic, self.lost, self.lost - told)
