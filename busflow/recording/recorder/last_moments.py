"""`LastMoments`: the messages of the last moments, in memory, within a time and a number of bytes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from operator import attrgetter
from typing import TYPE_CHECKING

from busflow.recording.mcap.writer import Payload, size_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from busflow.bus.endpoint import Endpoint
    from busflow.recording.recorder.channels import Track

EACH_BYTES = 256
"""The size that a message counts for beside its bytes."""


@dataclass(slots=True, eq=False)
class Kept:
    """A message that is kept, encoded."""

    track: Track
    sequence: int
    time_ns: int
    due_ns: int
    """The monotonic time from which on it is too old."""
    payload: Payload
    publisher: Endpoint | None
    """Its publisher, if that is transient_local."""
    is_recent: bool = True
    is_latched: bool = False

    @property
    def size(self) -> int:
        """The bytes that it counts for."""
        return size_of(self.payload) + EACH_BYTES


class LastMoments:
    """The last messages, and of each transient_local publisher the newest up to its depth, however old they are.

    All of them together have no more than so many bytes: the oldest leave first, and latched ones last.
    """

    def __init__(self, most_bytes: int) -> None:
        """Create an empty window of at most so many bytes."""
        self.bytes: int = 0
        """The bytes of all that is kept."""
        self.lost: int = 0
        """The number of latched messages for which there was no room."""
        self.most_bytes: int = most_bytes
        self._recent: deque[Kept] = deque()
        self._latched: dict[Endpoint, deque[Kept]] = {}

    def add(self, message: Kept, now_ns: int) -> None:
        """Keep a message from now on, at this monotonic time."""
        self._recent.append(message)
        self.bytes += message.size
        if message.publisher is not None:
            self._latch(message, message.publisher)
        self.forget(now_ns)

    def forget(self, now_ns: int) -> None:
        """Let messages go that are too old, or for which there is no room."""
        recent = self._recent
        while recent and (recent[0].due_ns <= now_ns or self.bytes > self.most_bytes):
            oldest = recent.popleft()
            oldest.is_recent = False
            self._release(oldest)
        while self.bytes > self.most_bytes:
            self._unlatch(min((kept[0] for kept in self._latched.values()), key=attrgetter("sequence")))
            self.lost += 1

    def latched(self) -> list[Kept]:
        """Return the latched messages that are older than the window, the oldest first."""
        older = (each for kept in self._latched.values() for each in kept if not each.is_recent)
        return sorted(older, key=attrgetter("sequence"))

    def __iter__(self) -> Iterator[Kept]:
        """Return the messages of the last moments, the oldest first."""
        return iter(self._recent)

    def _latch(self, message: Kept, publisher: Endpoint) -> None:
        known = self._latched.get(publisher)
        if known is not None and len(known) == publisher.qos.depth:
            self._unlatch(known[0])
        message.is_latched = True
        self._latched.setdefault(publisher, deque()).append(message)

    def _unlatch(self, message: Kept) -> None:
        """Take the oldest latched message of a publisher out."""
        if message.publisher is not None:
            kept = self._latched[message.publisher]
            kept.popleft()
            if not kept:
                del self._latched[message.publisher]
        message.is_latched = False
        self._release(message)

    def _release(self, message: Kept) -> None:
        if not message.is_recent and not message.is_latched:
            self.bytes -= message.size
