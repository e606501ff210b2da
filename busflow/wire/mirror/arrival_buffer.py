"""Arrival buffer: the messages of one topic that have arrived, by whatever way, and are not published yet."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable, Container, Sequence
from typing import TYPE_CHECKING, Any, Union

import zenoh

from busflow.wire.line.packets import Reason
from busflow.wire.zenoh.keys import GID_AT
from busflow.wire.zenoh.sender import LARGE, LARGEST

if TYPE_CHECKING:
    from busflow.wire.line import intake as line
    from busflow.wire.line.arena import Piece

Payload = Union[bytes, zenoh.ZBytes, "Piece", Reason]
"""A message's payload. One that is too large for the topic's type is not copied: it stays where it is.

A reason in its place means that the publisher's messages up to this number were dropped for it.
"""
Arrived = tuple[Payload, bytes]
"""A payload, and its attachment."""
_AS_IT_IS = (bytes, Reason)
CHUNK = 32
"""Number of messages that are taken together. A large one comes last: the processor still has it at hand."""


def is_large(message: Arrived) -> bool:
    """Return whether a message is large."""
    payload, _ = message
    return not isinstance(payload, Reason) and len(payload) >= LARGE


class ArrivalBuffer:
    """The messages of intakes and of Zenoh's ring buffer, in the order in which they came.

    The ring limits the number of samples, and in a thread of Zenoh, which never waits for the interpreter's lock. It
    knows no limit in bytes. So while the loop is busy for long, another thread calls `limit`. An intake limits itself.
    A payload is copied when its message is taken; a message that is skipped is not copied.
    """

    def __init__(
        self, depth: int, most_bytes: float, *, by_line: Container[bytes], on_heavy: Callable[[], None]
    ) -> None:
        """Create an empty buffer.

        Args:
            depth: the number of samples in the ring, and the limit of the messages outside.
            most_bytes: the size of the largest message that the topic can have.
            by_line: the publishers whose messages intakes bring: their samples are discarded.
            on_heavy: called once, in another thread, when messages are dropped because they have too many bytes.
        """
        self.depth: int = depth
        self.ring: Any = None
        """Zenoh's ring buffer, once there is one."""
        self.has_dropped: bool = False
        """Whether messages may have been dropped here, or in the ring, before those that were taken last."""
        self._most_bytes, self._by_line, self._on_heavy = most_bytes, by_line, on_heavy
        self._is_heavy = self._drops = False
        self._arrived: deque[Any] = deque()
        self._sources = deque[tuple["line.Intake | None", int]]()
        """Where the messages came from: each intake, or None for Zenoh, and how many came one after the other."""
        self._done = Counter["line.Intake"]()
        """By intake, the number of its messages that have left the buffer and are not acknowledged."""
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """Return the number of messages that wait, but for those in the ring."""
        return len(self._arrived)

    def put(self, arrived: Sequence[line.Arrived], intake: line.Intake) -> None:
        """Add the messages of an intake."""
        with self._lock:
            self._arrived.extend(arrived)
            self._sources.append((intake, len(arrived)))

    def put_sample(self, sample: zenoh.Sample) -> None:
        """Add a sample, which the ring has no more."""
        with self._lock:
            self._add(sample)

    def fill(self) -> None:
        """Take all samples out of the ring; drop the oldest messages beyond its depth."""
        if self.ring is None:
            return
        with self._lock:
            taken = 0
            try:
                while (sample := self.ring.try_recv()) is not None:
                    self._add(sample)
                    taken += 1
            except zenoh.ZError:
                pass  # the session is closed
            if len(self._arrived) > self.depth:
                self._drop(len(self._arrived) - self.depth)
            self._drops = self._drops or taken >= self.depth

    def limit(self) -> None:
        """Fill the buffer, and drop the oldest messages beyond `LARGEST` bytes, but not the newest one."""
        self.fill()
        with self._lock:
            sizes = [0 if isinstance(payload, Reason) else len(payload) for payload, _ in self._arrived]
            excess, count = sum(sizes) - LARGEST, 0
            while excess > 0 and count < len(sizes) - 1:
                excess -= sizes[count]
                count += 1
            self._drop(count)
        if count and not self._is_heavy:
            self._is_heavy = True
            self._on_heavy()

    def skip(self, keep: int, publishers: Container[bytes]) -> list[bytes]:
        """Remove messages of these publishers that are older than the newest `keep`; return their attachments.

        It stops at the first message of another publisher.
        """
        skipped: list[bytes] = []
        self.has_dropped = self._drops
        with self._lock:
            while len(self._arrived) > keep:
                payload, signature = self._arrived[0]
                if isinstance(payload, Reason) or signature[GID_AT:] not in publishers:
                    break
                self._arrived.popleft()
                skipped.append(signature)
            self._leave(len(skipped))
        self._acknowledge()
        return skipped

    def take(self, most: float = CHUNK) -> list[Arrived]:
        """Remove and return up to `most` of the oldest messages."""
        taken: list[Arrived] = []
        weight = 0
        self.has_dropped = self._drops
        with self._lock:
            arrived = self._arrived
            while arrived and weight < most:
                payload, signature = message = arrived.popleft()
                if not isinstance(payload, _AS_IT_IS) and len(payload) <= self._most_bytes:
                    message = payload.to_bytes(), signature
                taken.append(message)
                weight += CHUNK if is_large(message) else 1
            self._leave(len(taken))
            self._drops = self._drops and bool(arrived)
        self._acknowledge()
        return taken

    def discard(self, intake: line.Intake) -> None:
        """Remove the messages of an intake that is about to close: their memory is used again."""
        with self._lock:
            sources = [source for source, count in self._sources for _ in range(count)]
            kept = [each for each in zip(sources, self._arrived, strict=True) if each[0] is not intake]
            self._sources = deque((source, 1) for source, _ in kept)
            self._arrived = deque(message for _, message in kept)

    def _add(self, sample: zenoh.Sample) -> None:
        attachment = sample.attachment
        signature = b"" if attachment is None else attachment.to_bytes()
        if signature[GID_AT:] not in self._by_line:
            self._arrived.append((sample.payload, signature))
            self._sources.append((None, 1))

    def _drop(self, count: int) -> None:
        for _ in range(count):
            self._arrived.popleft()
        self._leave(count)
        self._drops = self._drops or count > 0

    def _leave(self, count: int) -> None:
        """Note where the oldest messages, which have left, came from."""
        while count:
            intake, waiting = self._sources.popleft()
            if waiting > count:
                self._sources.appendleft((intake, waiting - count))
            left = min(waiting, count)
            count -= left
            if intake is not None:
                self._done[intake] += left

    def _acknowledge(self) -> None:
        """Let the senders know how many messages have left; on the loop."""
        while self._done:
            intake, count = self._done.popitem()
            intake.acknowledge(count)
