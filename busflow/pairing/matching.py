"""Matching: which messages of several topics belong together, by their stamps alone. Pure.

What is matched depends on the stamps of each topic in their order, never on which topic's message came first: where a
later message could still be nearer, it is waited for. The least gap between the messages of a topic so far bounds how
soon its next one can be, so that a pair need not wait a whole period for the proof that it is the nearest.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

_SET_BACK_NS = 1_000_000_000
"""A stamp so much before the one in front of it means that time was set back, as by a bag that plays again."""


class Match:
    """The first messages of all topics belong together."""


@dataclass(frozen=True, slots=True)
class Alone:
    """The first messages of one topic, which find no partner."""

    topic: int
    count: int
    apart_ns: int
    """How far the last of them is from the nearest message of another topic."""


class Matcher:
    """Matches the messages of several topics, whose stamps it is given oldest first."""

    def __init__(self, topics: int, within_ns: int) -> None:
        """Create a matcher of messages whose stamps lie within some nanoseconds; 0 matches equal stamps only."""
        self._within_ns = within_ns
        self._gaps: list[int | None] = [None] * topics
        """The least gap between two messages of each topic, of those that have left its queue."""
        self._last: list[int | None] = [None] * topics
        self._times_set_back = [0] * topics

    def decide(self, queues: Sequence[Sequence[int]]) -> Match | Alone | None:
        """Return what can be said of the stamps that wait, whatever is still to come; None if nothing can."""
        for topic, stamps in enumerate(queues):
            if back := _set_back(stamps):
                return Alone(topic, back, stamps[back - 1] - stamps[back])
        if alone := self._before_others(queues):
            return alone
        if not all(queues):
            return None
        pivot = max(range(len(queues)), key=lambda topic: (queues[topic][0], -topic))
        latest = queues[pivot][0]
        first = min(range(len(queues)), key=lambda topic: (queues[topic][0], topic))
        if queues[first][0] < latest - self._within_ns:
            return Alone(first, 1, latest - queues[first][0])
        positions: list[int] = []
        for topic, stamps in enumerate(queues):
            position = 0 if topic == pivot else self._partner(topic, stamps, queues[pivot], pivot)
            if position is None:
                return None
            positions.append(position)
        return self._judge(queues, positions, first)

    def _before_others(self, queues: Sequence[Sequence[int]]) -> Alone | None:
        """Return a message from before time was set back, while another topic is beyond that."""
        times = [
            self._times_set_back[topic] + self._is_back(topic, stamps[0] if stamps else None)
            for topic, stamps in enumerate(queues)
        ]
        behind = [topic for topic, stamps in enumerate(queues) if stamps and times[topic] < max(times)]
        return Alone(behind[0], 1, abs(queues[behind[0]][0] - (self._last[behind[0]] or 0))) if behind else None

    def _is_back(self, topic: int, stamp: int | None) -> bool:
        last = self._last[topic]
        return stamp is not None and last is not None and stamp < last - _SET_BACK_NS

    def leave(self, topic: int, stamps: Sequence[int]) -> None:
        """Note that messages of a topic have left its queue."""
        for stamp in stamps:
            last = self._last[topic]
            self._times_set_back[topic] += self._is_back(topic, stamp)
            self._gaps[topic] = _least(self._gaps[topic], stamp, last)
            self._last[topic] = stamp

    def _judge(self, queues: Sequence[Sequence[int]], positions: Sequence[int], first: int) -> Match | Alone:
        """Return a match if these positions are the first of each topic, else messages that have to go before it."""
        stamps = [queue[position] for queue, position in zip(queues, positions, strict=True)]
        if max(stamps) - min(stamps) > self._within_ns:  # of three and more, with the pivot in the middle
            return Alone(first, 1, max(stamps) - min(stamps))
        for topic, position in enumerate(positions):
            if position:
                last = queues[topic][position - 1]
                return Alone(topic, position, min(abs(last - other) for at, other in enumerate(stamps) if at != topic))
        return Match()

    def _partner(self, topic: int, stamps: Sequence[int], pivots: Sequence[int], pivot: int) -> int | None:
        """Return the position of the pivot's partner in another topic; None if a later message may still change it."""
        wanted = pivots[0]
        position = self._nearest(topic, stamps, wanted)
        if position is None or stamps[position] <= wanted:
            return position
        apart = stamps[position] - wanted  # it is later: perhaps the pivot's next message is nearer to it
        if self._is_settled(apart, self._gap(pivot, pivots)):
            return position
        if len(pivots) == 1:
            return None
        return position - 1 if abs(pivots[1] - stamps[position]) < apart else position

    def _nearest(self, topic: int, stamps: Sequence[int], wanted: int) -> int | None:
        """Return the position of the stamp nearest to another one; None if a later one may still be nearer."""
        gap = self._gap(topic, stamps)
        for position, stamp in enumerate(stamps):
            if position:
                gap = _least(gap, stamp, stamps[position - 1])
            if stamp >= wanted or self._is_settled(wanted - stamp, gap):
                return position
            if position + 1 < len(stamps) and abs(stamps[position + 1] - wanted) > wanted - stamp:
                return position
        return None

    def _is_settled(self, apart_ns: int, gap: int | None) -> bool:
        """Return whether the next message, after at least half of the least gap so far, cannot be nearer.

        That is asked before the next message is looked at, so that the result is the same whether it is there.
        """
        return gap is not None and 4 * apart_ns <= gap

    def _gap(self, topic: int, stamps: Sequence[int]) -> int | None:
        """Return the least gap between the messages of a topic, up to the first that waits."""
        return _least(self._gaps[topic], stamps[0], self._last[topic])


def _least(gap: int | None, stamp: int, before: int | None) -> int | None:
    """Return the least of a gap and the one between two stamps, if that is one."""
    if before is None or stamp <= before:
        return gap
    return stamp - before if gap is None else min(gap, stamp - before)


def _set_back(stamps: Sequence[int]) -> int:
    """Return how many messages come before the first one that was stamped after time was set back."""
    for position in range(1, len(stamps)):
        if stamps[position] < stamps[position - 1] - _SET_BACK_NS:
            return position
    return 0
