"""Arrivals: which messages of each remote publisher have reached a topic, also before a broken link."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.bus.subscription import Subscription

_MOST = 256
"""Limit of the publishers that are present, and of those that have gone; a sender without a token counts too."""
_MOST_GAPS = 64


@dataclass(slots=True)
class _Record:
    first: int
    """The number that arrived first; those before it do not count as lost."""
    gaps: list[range]
    """The numbers that have not arrived, the oldest gaps first."""
    newcomers: list[Subscription[Any]] = field(default_factory=list["Subscription[Any]"])
    """Subscriptions that were made while the publisher was away."""


class Arrivals:
    """Numbers of the messages that have arrived on one topic, by publisher.

    A message that comes again, on a second path or because a link is back, is recognized by its number. Publishers that
    have gone are remembered: if only their link broke, they come back with the same gid.
    """

    def __init__(self, losses: Counter[str]) -> None:
        """Create a record without publishers; missing messages are counted in `losses` as `lost`."""
        self.last: dict[bytes, int] = {}
        """By publisher that has not gone, its highest number. A message with the next one may be recorded here."""
        self._losses = losses
        self._records: dict[bytes, _Record] = {}
        self._gone: dict[bytes, int] = {}
        """By publisher that has gone, its highest number."""

    def note(self, gid: bytes, sequence: int) -> bool:
        """Record a message, and count the missing ones before it; return False if it has arrived before."""
        numbers = self._gone if gid in self._gone else self.last
        last = numbers.get(gid)
        if last is None:
            if len(numbers) < _MOST:  # there may be any number of unknown senders
                numbers[gid] = sequence
                self._records[gid] = _Record(sequence, [range(1, sequence)])
            return True
        if sequence <= last:
            return self._fill(self._records[gid], sequence)
        numbers[gid] = sequence
        if missing := sequence - last - 1:
            gaps = self._records[gid].gaps
            gaps.append(range(last + 1, sequence))
            del gaps[:-_MOST_GAPS]
            self._losses["lost"] += missing
        return True

    def _fill(self, record: _Record, sequence: int) -> bool:
        """Take a number out of its gap, and out of the losses; return False if it is in none."""
        for index, gap in enumerate(record.gaps):
            if sequence in gap:
                halves = range(gap.start, sequence), range(sequence + 1, gap.stop)
                record.gaps[index : index + 1] = [half for half in halves if half]
                del record.gaps[:-_MOST_GAPS]  # numbers out of order could divide them without end
                if sequence > record.first:
                    self._losses["lost"] -= 1
                    if not self._losses["lost"]:
                        del self._losses["lost"]
                return True
        return False

    def leave(self, gid: bytes) -> None:
        """Remember a publisher that has gone; the one that went first is forgotten if there are too many."""
        if (last := self.last.pop(gid, None)) is not None:
            self._gone[gid] = last
            if len(self._gone) > _MOST:
                self.forget(next(iter(self._gone)))

    def come(self, gid: bytes) -> Collection[Subscription[Any]] | None:
        """Return the subscriptions that were made while this publisher was away; None if it is new."""
        if gid not in self._gone:
            return None
        self.last[gid] = self._gone.pop(gid)
        record = self._records[gid]
        newcomers, record.newcomers = record.newcomers, []
        return newcomers

    def forget(self, gid: bytes) -> None:
        """Forget a publisher."""
        for book in (self.last, self._gone, self._records):
            book.pop(gid, None)

    def meet(self, subscription: Subscription[Any], former: Subscription[Any] | None, present: Collection[Any]) -> None:
        """Note a new subscription, or one in the place of `former`, for the publishers that are away.

        Args:
            subscription: the one that has come.
            former: the one whose place, queue and messages it has.
            present: the topic's subscriptions; others are forgotten.
        """
        for gid in self._gone:
            newcomers = self._records[gid].newcomers
            if former is None or former in newcomers:
                newcomers.append(subscription)
            newcomers[:] = [each for each in newcomers if each in present]
