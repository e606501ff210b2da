"""Account: what became of every message that was published to one subscription; a line of the ledger."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field, replace

from busflow.bus.qos import Overflow


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
