"""OrderedMessages: the messages of a bag that are played, one after another, within a span of time."""

from __future__ import annotations

import asyncio
import re
import shlex
from collections import deque
from collections.abc import Collection, Generator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

from busflow.bus.names import absolute_name, full_topic_name_fault
from busflow.bus.patterns import Selection, check_pattern
from busflow.clock import NS_PER_S
from busflow.errors import BagError, NoSuchTarget
from busflow.recording.bag.channel import Channel, Entry, unreadable
from busflow.recording.bag.kept import kept
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag


@dataclass(frozen=True, slots=True)
class Span:
    """The part of a recording that is played, in nanoseconds; offsets count from its first message."""

    start_ns: int = 0
    until_ns: int | None = None
    """The offset of the last moment that is played."""
    duration_ns: int | None = None
    """The duration played from `start_ns` on. Where both are given, the later end counts, as in ROS 2."""

    @classmethod
    def of_seconds(cls, start_s: float, until_s: float | None, duration_s: float | None) -> Span:
        """Return the part that is stated in seconds.

        >>> Span.of_seconds(0.5, None, 2.0)
        Span(start_ns=500000000, until_ns=None, duration_ns=2000000000)
        """
        return cls(
            _ns(start_s), None if until_s is None else _ns(until_s), None if duration_s is None else _ns(duration_s)
        )

    def end_ns(self, first_ns: int) -> int | None:
        """Return the last moment that is played, None for the recording's end."""
        ends = [] if self.until_ns is None else [first_ns + self.until_ns]
        if self.duration_ns is not None:  # nothing is played in no time, though the end itself is played
            ends.append(first_ns + self.start_ns + self.duration_ns if self.duration_ns > 0 else first_ns - 1)
        return max(ends, default=None)


_UNFIT = re.compile(r"[^A-Za-z0-9_]+")
_AHEAD_BYTES = 256 * 1024
"""The number of bytes read at a time; at most twice as many are held, or one larger message."""
_EACH_BYTES = 256
"""The size that a message counts for beside its bytes."""

_Read: TypeAlias = "tuple[list[Entry], bool]"
"""Some messages, and whether they are the last."""


class OrderedMessages:
    """Messages in the order in which they were recorded, which the time stamps alone do not give.

    It keeps a file open, and a thread, in which chunks are read, unpacked and checked against their CRC while the loop
    goes on. On simulated time there is no thread, so that nothing depends on its speed.
    """

    def __init__(self, bag: Bag, channels: Collection[Channel], span: Span | None = None, *, threaded: bool) -> None:
        """Open the messages of some channels in a part of the recording; the caller closes it."""
        span = span or Span()
        self._bag, self._channels = bag, frozenset(channels)
        self._first_ns, last_ns = bag.start_ns or 0, bag.end_ns or 0  # of a bag without messages there is none
        self.start_ns: int = self._first_ns + max(0, span.start_ns)
        """The first moment that is played."""
        end_ns = span.end_ns(self._first_ns)
        self.end_ns: int = last_ns if end_ns is None else min(end_ns, last_ns)
        """The last moment that is played."""
        self._bound_ns = end_ns
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="busflow.reader") if threaded else None
        self._ready: deque[Entry] = deque()
        self._reading: asyncio.Future[_Read] | None = None
        self._is_read = False
        self._entries = self._from(self.start_ns)

    async def look(self) -> Entry | None:
        """Wait until the next message is read, and return it without taking it; None at the end."""
        while not self._ready and not self._is_read:
            if self._thread is None:
                self._take_in(self._read(self._entries, 0))
                continue
            reading = self._reading = self._reading or self._read_ahead(self._thread)
            await asyncio.wait([reading])
            if reading is not self._reading:
                continue  # another task has taken it in meanwhile, or a seek has dropped it
            self._reading = None
            self._take_in(reading.result())
            if not self._is_read:
                self._reading = self._read_ahead(self._thread)
        return self._ready[0] if self._ready else None

    def is_next(self, entry: Entry) -> bool:
        """Return whether this message, which `look` has returned, is still the next one."""
        return bool(self._ready) and self._ready[0] is entry

    def take(self) -> Entry:
        """Take the message that `look` has returned: the one after it is the next."""
        return self._ready.popleft()

    def seek(self, moment_ns: int) -> None:
        """Go on with the first message of a moment or later, also back from the end."""
        if self._thread is None:
            self._entries.close()
        else:
            self._thread.submit(self._entries.close)  # where it is being read, and after what is being read
        self._entries = self._from(max(moment_ns, self.start_ns))
        self._ready.clear()
        self._reading, self._is_read = None, False

    async def close(self) -> None:
        """Close the file, and end the thread."""
        if self._thread is None:
            self._entries.close()
            return
        try:
            await asyncio.get_running_loop().run_in_executor(self._thread, self._entries.close)
        finally:
            self._thread.shutdown(wait=False)

    def _from(self, moment_ns: int) -> Generator[Entry]:
        if moment_ns <= self._first_ns:  # what the clock set back is played from the start
            return self._bag.entries(self._channels.__contains__)
        return self._later(moment_ns)

    def _later(self, moment_ns: int) -> Generator[Entry]:
        wanted = self._channels.__contains__
        yield from kept(self._bag, wanted, moment_ns)
        yield from self._bag.entries(wanted, start_ns=moment_ns)

    def _read_ahead(self, thread: ThreadPoolExecutor) -> asyncio.Future[_Read]:
        return asyncio.get_running_loop().run_in_executor(thread, self._read, self._entries, _AHEAD_BYTES)

    def _read(self, entries: Generator[Entry], most_bytes: int) -> _Read:
        """Read the next messages within the bounds; if the clock was set back, one beyond them may precede others."""
        found: list[Entry] = []
        for entry in entries:
            if self._bound_ns is None or entry.log_time_ns <= self._bound_ns:
                found.append(entry)
                most_bytes -= len(entry.payload) + _EACH_BYTES
                if most_bytes <= 0:
                    return found, False
        return found, True

    def _take_in(self, read: _Read) -> None:
        self._ready.extend(read[0])
        self._is_read = read[1]


def chosen(
    channels: Collection[Channel], topics: Sequence[str] = (), exclude: Sequence[str] = (), rename: Collection[str] = ()
) -> tuple[Channel, ...]:
    """Return the channels that are to be played, by patterns of topics as for recording; hidden ones have to be named.

    Raises:
        NoSuchTarget: One of the patterns matches nothing, or a topic to be renamed is not among them.
        InvalidName: One cannot match any name.
    """
    names = {each.topic for each in channels}
    for pattern in (*topics, *exclude):
        if not any(Selection([pattern], foreign=True).includes(each, absolute_name(each)) for each in names):
            check_pattern(pattern)
            raise NoSuchTarget(f"there is nothing on {printable(pattern)}; {did_you_mean(pattern, names)}")
    selection = Selection(topics, exclude, foreign=True)
    found = tuple(each for each in channels if selection.includes(each.topic, absolute_name(each.topic)))
    played = {each.topic for each in found}
    for topic in rename:
        if topic not in played | set(map(absolute_name, played)):
            advice = did_you_mean(topic, played)
            raise NoSuchTarget(f"the remap of {printable(topic)} matches no topic that is played; {advice}")
    return found


def published_as(topic: str, rename: Mapping[str, str]) -> str:
    """Return the topic on which a recorded topic is published."""
    return rename.get(topic) or rename.get(absolute_name(topic)) or absolute_name(topic)


def playable(
    channels: Collection[Channel], rename: Mapping[str, str]
) -> tuple[tuple[Channel, ...], dict[Channel, BagError]]:
    """Return the channels whose messages can be published, and the reason for each of the others.

    Raises:
        BagError: There are some, and none can be published.
    """
    faults = unreadable(channels, lambda channel: _fault(channel, rename))
    return tuple(each for each in channels if each not in faults), faults


def _fault(channel: Channel, rename: Mapping[str, str]) -> BagError | None:
    if channel.fault is None and not channel.type_name:
        return BagError(f"{channel.topic} has no type, and a publisher needs one")
    if channel.fault is None and (wrong := full_topic_name_fault(published_as(channel.topic, rename))):
        instead = channel.topic and f"--remap {shlex.quote(f'{channel.topic}:={_fitting(channel.topic)}')}"
        reason = f"{printable(channel.topic)!r} is not the name of a topic in ROS: {wrong.message}"
        return BagError(reason, fix=instead or None)
    return channel.fault


def _fitting(topic: str) -> str:
    """Return a name that a topic may have, as near as possible to one that it may not.

    >>> _fitting("front-left//2d.count")
    '/front_left/n2d_count'
    """
    parts = [re.sub(r"_+", "_", _UNFIT.sub("_", each)) for each in topic.split("/") if each]
    return "/" + "/".join(f"n{each}" if each[0].isdigit() or each[0] == "_" else each for each in parts or ["topic"])


def _ns(seconds: float) -> int:
    return round(seconds * NS_PER_S)
