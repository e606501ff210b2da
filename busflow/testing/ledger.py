"""Ledger: what became of every message of a graph, as sums and line by line."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from busflow.bus.accounts import SubscriptionStatistics


@dataclass(frozen=True, slots=True)
class Ledger:
    """The lines of all subscriptions there are or were; in each, published = delivered + dropped + queued."""

    lines: tuple[SubscriptionStatistics, ...]

    @property
    def published(self) -> int:
        """How many messages were published, counted once for each subscription."""
        return sum(line.published for line in self.lines)

    @property
    def delivered(self) -> int:
        """How many were handed over."""
        return sum(line.delivered for line in self.lines)

    @property
    def dropped(self) -> int:
        """How many were lost, for whatever reason."""
        return sum(line.dropped for line in self.lines)

    @property
    def queued(self) -> int:
        """How many wait now."""
        return sum(line.queued for line in self.lines)

    def __iter__(self) -> Iterator[SubscriptionStatistics]:
        return iter(self.lines)

    def __str__(self) -> str:
        return "\n".join(map(_shown, self.lines))


def _shown(line: SubscriptionStatistics) -> str:
    reasons = ", ".join(f"{count} {reason}" for reason, count in sorted(line.drops.items()))
    return (
        f"{line.node} on {line.topic}: {line.published} published = {line.delivered} delivered + "
        f"{line.dropped} dropped{f' ({reasons})' if reasons else ''} + {line.queued} queued"
    )
