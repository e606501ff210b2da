"""Arrivals: records which messages of each remote publisher have arrived on a topic, over broken links too."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from busflow.bus.statistics import LINK
from busflow.wire.zenoh.keys import MOST_MISSING

if TYPE_CHECKING:
    from busflow.bus.publisher import Publisher
    from busflow.bus.subscription import Subscription
    from busflow.bus.topic import Topic

_MOST_PUBLISHERS = 256
"""Limit of the present publishers, and the same limit of those that have gone; senders without a token count too."""
_MOST_GAPS = 64
"""Limit of the gaps by publisher; the oldest are forgotten."""


@dataclass(slots=True)
class _Record:
    first: int
    """The number that arrived first; missing numbers before it do not count as lost."""
    gaps: list[range]
    """The numbers that have not arrived, the oldest gaps first."""
    newcomers: list[Subscription[Any]] = field(default_factory=list["Subscription[Any]"])
    """Subscriptions that were made while the publisher was away."""


class Arrivals:
    """Numbers of the messages that have arrived on one topic, by publisher.

    A message may arrive twice, on a second path or after a link has come back: its number shows that. Publishers that
    have gone are remembered, because after a broken link they come back with the same gid.
    """

    def __init__(self, topic: Topic[Any]) -> None:
        """Create a record without publishers; the topic counts missing messages as `lost`, kept ones as `earlier`."""
        self.last: dict[bytes, int] = {}
        """By present publisher, its highest number. The caller may record the next number here, without `note`."""
        self._topic = topic
        self._records: dict[bytes, _Record] = {}
        self._gone: dict[bytes, int] = {}
        """By publisher that has gone, its highest number."""
        self._kept: dict[bytes, set[int]] = {}
        """By publisher, the numbers that have come only because a late joiner asked for them."""

    def note_kept(self, gid: bytes, numbers: Collection[int]) -> None:
        """Count messages that came because a late joiner asked for them, unless they have come before."""
        known = self._kept.setdefault(gid, set())
        if len(self._kept) > 2 * _MOST_PUBLISHERS:
            del self._kept[next(iter(self._kept))]
        record, last = self._records.get(gid), self.last.get(gid, 0)
        for number in set(numbers) - known:
            if record is None or not record.first <= number <= last or self._fill(record, number):
                known.add(number)
                self._topic.earlier += 1

    def note(
        self,
        gid: bytes,
        sequence: int,
        *,
        ordered: bool = False,
        overflowed: Publisher[Any] | None = None,
        reason: str = LINK,
    ) -> bool:
        """Record a message, and count the missing ones before it; return False if it is not to be published.

        That is one that has arrived before. With `ordered` it is any that arrives after a newer one: Zenoh brings kept
        messages in order, so an older one was overtaken while a link was broken. Missing messages count as lost for
        this reason, or as overflow if `overflowed`, their publisher, is given: the receiver has dropped them.
        """
        numbers = self._gone if gid in self._gone else self.last
        last = numbers.get(gid)
        if last is not None and abs(sequence - last) > MOST_MISSING:
            del numbers[gid]
            last = None
        if last is not None and sequence <= last:
            return not ordered and self._fill(self._records[gid], sequence)
        if sequence in (known := self._kept.get(gid, set())):
            known.remove(sequence)
            self._topic.earlier -= 1
        if last is None:
            if len(numbers) < _MOST_PUBLISHERS:  # there may be any number of unknown senders
                numbers[gid] = sequence
                self._records[gid] = _Record(sequence, [range(1, sequence)])
            return True
        numbers[gid] = sequence
        missing = sequence - last - 1
        if missing and overflowed is not None:
            self._topic.count_overflow(overflowed, missing)
        elif missing:
            gaps = self._records[gid].gaps
            gaps.append(range(last + 1, sequence))
            del gaps[:-_MOST_GAPS]
            self._topic.count_lost(reason, missing)
        return True

    def _fill(self, record: _Record, sequence: int) -> bool:
        """Remove a number from its gap and from the losses; return False if no gap has it."""
        for index, gap in enumerate(record.gaps):
            if sequence in gap:
                halves = range(gap.start, sequence), range(sequence + 1, gap.stop)
                record.gaps[index : index + 1] = [half for half in halves if half]
                del record.gaps[:-_MOST_GAPS]  # numbers out of order could divide them without end
                if sequence > record.first:
                    self._topic.count_lost(LINK, -1)
                return True
        return False

    def leave(self, gid: bytes) -> None:
        """Record that a publisher has gone; if too many have, forget the one that went first."""
        if (last := self.last.pop(gid, None)) is not None:
            self._gone[gid] = last
            if len(self._gone) > _MOST_PUBLISHERS:
                self.forget(next(iter(self._gone)))

    def come(self, gid: bytes) -> Collection[Subscription[Any]] | None:
        """Record that a publisher has come; return the subscriptions made while it was away, or None if it is new."""
        if gid not in self._gone:
            return None
        self.last[gid] = self._gone.pop(gid)
        record = self._records[gid]
        newcomers, record.newcomers = record.newcomers, []
        return newcomers

    def forget(self, gid: bytes) -> None:
        """Forget a publisher."""
        for book in (self.last, self._gone, self._records, self._kept):
            book.pop(gid, None)

    def add(self, subscription: Subscription[Any], former: Subscription[Any] | None, present: Collection[Any]) -> None:
        """Record a subscription as made while publishers are away, unless its predecessor was made before they went.

        Args:
            subscription: the new subscription.
            former: its predecessor before a restart, whose queue and messages it has; None if there is none.
            present: all subscriptions of the topic; recorded ones that are not among them are forgotten.
        """
        for gid in self._gone:
            newcomers = self._records[gid].newcomers
            if former is None or former in newcomers:
                newcomers.append(subscription)
            newcomers[:] = [each for each in newcomers if each in present]
