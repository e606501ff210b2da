"""Arrival buffer: the messages of one topic that have arrived, by whatever way, and are not published yet."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import threading
from collections import Counter, deque
from collections.abc import Callable, Container, Sequence
from typing import TYPE_CHECKING, Any

import zenoh

from busflow.wire.line.arena import Piece
from busflow.wire.line.packets import Reason
from busflow.wire.zenoh.keys import GID_AT
from busflow.wire.zenoh.sender import LARGE, LARGEST

if TYPE_CHECKING:
    from busflow.wire.line import intake as line

    _Waiting = tuple[Any, bytes, line.Intake | None]

Payload = bytes | zenoh.ZBytes | Reason
"""A message's payload. One that is too large for the topic's type is not copied: it stays Zenoh's.

A reason in its place means that the publisher's messages up to this number were dropped for it.
"""
Arrived = tuple[Payload, bytes]
"""A payload, and its attachment."""
CHUNK = 32
"""Number of messages that are taken together. A large one comes last: the processor still has it at hand."""


def is_large(message: Arrived) -> bool:
    """Return whether a message is large."""
    payload, _ = message
    return not isinstance(payload, Reason) and len(payload) >= LARGE


class ArrivalBuffer:
    """The messages of intakes and of Zenoh's ring buffer, in the order in which they came.

    The ring limits the number of samples, and in a thread of Zenoh, which never waits for the interpreter's lock. It
    knows no limit in bytes. So while the loop is busy for long, another thread calls `fill`. An intake limits itself.
    A payload is copied when its message is taken; a message that is skipped is not copied.
    """

    def __init__(
        self, depth: int, most_bytes: float, *, by_line: Container[bytes], on_heavy: Callable[[], None]
    ) -> None:
        """Create an empty buffer.

        Args:
            depth: the number of samples in the ring, and the limit of the samples outside.
            most_bytes: the size of the largest message that the topic can have.
            by_line: the publishers whose messages intakes bring: their samples are discarded.
            on_heavy: called once, in any thread, when samples are dropped because they have too many bytes.
        """
        self.ring: Any = None
        """Zenoh's ring buffer, once there is one."""
        self.has_dropped: bool = False
        """Whether samples may have been dropped here, or in the ring, before the messages that were taken last."""
        self._depth, self._most_bytes, self._by_line, self._on_heavy = depth, most_bytes, by_line, on_heavy
        self._is_heavy = self._drops = False
        self._arrived: deque[_Waiting] = deque()
        self._samples = self._bytes = 0
        """Number and size of the messages that came through Zenoh."""
        self._done = Counter["line.Intake"]()
        """By intake, the number of its messages that are published or skipped, and not acknowledged."""
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """Return the number of messages that wait, but for those in the ring."""
        return len(self._arrived)

    def put(self, arrived: Sequence[line.Arrived], intake: line.Intake) -> None:
        """Add the messages of an intake."""
        with self._lock:
            self._arrived.extend((payload, signature, intake) for payload, signature in arrived)

    def put_sample(self, sample: zenoh.Sample) -> None:
        """Add a sample, which the ring has no more."""
        with self._lock:
            self._add(sample)

    def fill(self) -> None:
        """Take all samples out of the ring; drop the oldest beyond its depth, or beyond `LARGEST` bytes.

        One sample is kept, however large.
        """
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
            is_heavy = self._bytes > LARGEST and self._samples > 1
            if is_heavy or self._samples > self._depth:
                self._drop_samples()
                taken = self._depth
            self._drops = self._drops or taken >= self._depth
        if is_heavy and not self._is_heavy:
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
                payload, signature, intake = self._arrived[0]
                if isinstance(payload, Reason) or signature[GID_AT:] not in publishers:
                    break
                self._arrived.popleft()
                self._note_done(payload, intake)
                skipped.append(signature)
        return skipped

    def take(self, most: float = CHUNK) -> list[Arrived]:
        """Remove and return up to `most` of the oldest messages."""
        taken: list[Arrived] = []
        weight = 0
        self.has_dropped = self._drops
        with self._lock:
            while self._arrived and weight < most:
                payload, signature, intake = self._arrived.popleft()
                self._note_done(payload, intake)
                taken.append((self._copied(payload), signature))
                weight += CHUNK if is_large(taken[-1]) else 1
            self._drops = self._drops and bool(self._arrived)
        return taken

    def acknowledge(self) -> None:
        """Let the senders know that what was taken and skipped is done with."""
        done, self._done = self._done, Counter["line.Intake"]()
        for intake, count in done.items():
            intake.acknowledge(count)

    def _copied(self, payload: Any) -> Payload:
        is_small = isinstance(payload, zenoh.ZBytes) and len(payload) <= self._most_bytes
        return payload.to_bytes() if is_small or isinstance(payload, Piece) else payload

    def discard(self, intake: line.Intake) -> None:
        """Remove the messages of an intake that is about to close: their memory is used again."""
        with self._lock:
            self._arrived = deque(each for each in self._arrived if each[2] is not intake)
        self._done.pop(intake, None)

    def _add(self, sample: zenoh.Sample) -> None:
        attachment, payload = sample.attachment, sample.payload
        signature = b"" if attachment is None else attachment.to_bytes()
        if signature[GID_AT:] not in self._by_line:
            self._arrived.append((payload, signature, None))
            self._samples += 1
            self._bytes += len(payload)

    def _drop_samples(self) -> None:
        """Drop the oldest samples that are too many or too large; messages of intakes stay."""
        arrived, self._arrived = self._arrived, deque()
        for payload, signature, intake in arrived:
            is_too_much = self._samples > self._depth or (self._bytes > LARGEST and self._samples > 1)
            if intake is None and is_too_much:
                self._note_done(payload, None)
            else:
                self._arrived.append((payload, signature, intake))

    def _note_done(self, payload: Any, intake: line.Intake | None) -> None:
        if intake is None:
            self._samples -= 1
            self._bytes -= len(payload)
        else:
            self._done[intake] += 1
