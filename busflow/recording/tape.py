"""Tape: the messages of a bag that are to be played, one after another, from and to where they were asked for."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from busflow.clock import NS_PER_S
from busflow.errors import BagError
from busflow.patterns import Selection
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.recording.bag import Bag
    from busflow.recording.channel import Channel, Entry


@dataclass(frozen=True, slots=True)
class Span:
    """Which part of a recording is played, in nanoseconds; offsets count from its first message."""

    start_ns: int = 0
    until_ns: int | None = None
    """The offset of the last moment that is played."""
    duration_ns: int | None = None
    """How long is played from `start_ns` on. Where both are given, the later end counts, as in ROS 2."""

    @classmethod
    def of_seconds(cls, start_s: float, until_s: float | None, duration_s: float | None) -> Span:
        """The part that is said in seconds.

        >>> Span.of_seconds(0.5, None, 2.0)
        Span(start_ns=500000000, until_ns=None, duration_ns=2000000000)
        """
        return cls(
            _ns(start_s), None if until_s is None else _ns(until_s), None if duration_s is None else _ns(duration_s)
        )

    def end_ns(self, first_ns: int) -> int | None:
        """The last moment that is played, None for the recording's end."""
        ends = [] if self.until_ns is None else [first_ns + self.until_ns]
        if self.duration_ns is not None:  # nothing is played in no time, though the end itself is played
            ends.append(first_ns + self.start_ns + self.duration_ns if self.duration_ns > 0 else first_ns - 1)
        return max(ends, default=None)


class Tape:
    """Messages in the order in which they were recorded, which the time stamps alone do not give."""

    def __init__(self, bag: Bag, channels: Collection[Channel], span: Span | None = None) -> None:
        """The messages of some channels, of a part of the recording."""
        span = span or Span()
        self._bag, self._channels = bag, frozenset(channels)
        self._first_ns, last_ns = bag.start_ns or 0, bag.end_ns or 0  # of a bag without messages there is none
        self.start_ns = self._first_ns + max(0, span.start_ns)
        """The first moment that is played."""
        end_ns = span.end_ns(self._first_ns)
        self.end_ns = last_ns if end_ns is None else min(end_ns, last_ns)
        """The last moment that is played."""
        self._bound_ns = end_ns
        self._entries: Iterator[Entry] = iter(())
        self._next: Entry | None = None
        self.rewind()

    @property
    def next(self) -> Entry | None:
        """The message that comes next, None at the end."""
        return self._next

    def take(self) -> Entry | None:
        """The message that comes next, which is not next any more."""
        taken, self._next = self._next, self._look()
        return taken

    def rewind(self) -> None:
        """Begin anew."""
        self.seek(self.start_ns)

    def seek(self, moment_ns: int) -> None:
        """Go on with the first message of a moment or later, also back from the end."""
        start_ns = max(moment_ns, self.start_ns)
        begin = None if start_ns <= self._first_ns else start_ns  # what the clock set back is played from the start
        self._entries = self._bag.entries(self._channels.__contains__, start_ns=begin)
        self._next = self._look()

    def _look(self) -> Entry | None:
        """The next message within the bounds; with a clock that was set back, one beyond them may come before it."""
        for entry in self._entries:
            if self._bound_ns is None or entry.log_time_ns <= self._bound_ns:
                return entry
        return None


def chosen(
    channels: Collection[Channel], topics: Sequence[str] = (), exclude: Sequence[str] = ()
) -> tuple[Channel, ...]:
    """The channels that are to be played, by patterns of topics as for recording; hidden ones have to be named.

    Raises:
        BagError: One of the patterns matches nothing.
        InvalidName: One cannot match any name.
    """
    names = {each.topic for each in channels}
    for pattern in (*topics, *exclude):
        if not any(map(Selection([pattern]).includes, names)):
            raise BagError(f"there is nothing on {pattern}", fix=did_you_mean(pattern, names))
    selection = Selection(topics, exclude)
    return tuple(each for each in channels if selection.includes(each.topic))


def _ns(seconds: float) -> int:
    return round(seconds * NS_PER_S)
