"""Arrival buffer: the messages of one topic that have arrived and are not published yet."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Container
from typing import Any

import zenoh

from busflow.errors import MalformedMessage
from busflow.wire.mirror.burst import MOST_BYTES, is_burst, taken_apart
from busflow.wire.zenoh.keys import ATTACHMENT_BYTES, GID_AT
from busflow.wire.zenoh.sender import LARGE, LARGEST

Arrived = tuple[bytes | zenoh.ZBytes, bytes]
"""A message's payload, and its attachment. A payload too large for the topic's type is not copied: it stays Zenoh's."""


CHUNK = 32
"""Number of messages that are taken together. A large one comes last: the processor still has it at hand."""


def is_large(message: Arrived) -> bool:
    """Return whether a message is large, or lies in shared memory, where all are."""
    payload, signature = message
    return len(payload) >= LARGE or len(signature) > ATTACHMENT_BYTES


class ArrivalBuffer:
    """Zenoh's ring buffer, in which a burst is one sample, and the samples that are out of it already.

    The ring limits the number of samples, and in a thread of Zenoh, which never waits for the interpreter's lock. It
    knows no limit in bytes. So while the loop is busy for long, another thread calls `fill`. A payload is copied when
    its message is taken; a message that is skipped is not copied.
    """

    def __init__(
        self,
        ring: Any,
        depth: int,
        most_bytes: float,
        *,
        on_malformed: Callable[[MalformedMessage], None],
        on_heavy: Callable[[], None],
    ) -> None:
        """Create an empty buffer.

        Args:
            ring: the handler of a subscriber with a ring buffer.
            depth: the number of samples in the ring, and the limit of the samples outside.
            most_bytes: the size of the largest message that the topic can have.
            on_malformed: called for a burst that cannot be read.
            on_heavy: called once, in any thread, when samples are dropped because they have too many bytes.
        """
        self.has_dropped: bool = False
        """Whether samples may have been dropped here, or in the ring, before the messages that were taken last."""
        self._ring, self._depth, self._most_bytes = ring, depth, most_bytes
        self._on_malformed, self._on_heavy = on_malformed, on_heavy
        self._is_heavy = self._drops = False
        self._samples = deque[tuple[zenoh.ZBytes, bytes]]()
        self._messages = self._bytes = 0
        self._lock = threading.Lock()

    def __len__(self) -> int:
        """Return the number of messages that wait, but for those in the ring."""
        return self._messages

    def wait(self) -> None:
        """Wait for the next sample and take it out of the ring, while nothing else does; in a thread of its own.

        Raises:
            ZError: The subscriber is undeclared, which ends the wait.
        """
        sample = self._ring.recv()
        with self._lock:
            self._put(sample)

    def fill(self) -> None:
        """Take all samples out of the ring; drop the oldest beyond its depth, or beyond `LARGEST` bytes.

        One sample is kept, however large.
        """
        with self._lock:
            samples, taken = self._samples, 0
            try:
                while (sample := self._ring.try_recv()) is not None:
                    self._put(sample)
                    taken += 1
            except zenoh.ZError:
                pass  # the session is closed
            is_heavy = self._bytes > LARGEST and len(samples) > 1
            while len(samples) > self._depth or (self._bytes > LARGEST and len(samples) > 1):
                self._pop()
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
            while self._samples:
                signature = self._samples[0][1]
                count = _messages_in(signature)
                if self._messages - count < keep or signature[GID_AT:ATTACHMENT_BYTES] not in publishers:
                    break
                self._pop()
                ends = range(ATTACHMENT_BYTES, count * ATTACHMENT_BYTES + 1, ATTACHMENT_BYTES)
                skipped += [signature[end - ATTACHMENT_BYTES : end] for end in ends]
        return skipped

    def take(self, most: float = CHUNK) -> list[Arrived]:
        """Remove and return up to `most` of the oldest messages, and the rest of a burst."""
        taken: list[Arrived] = []
        weight = 0
        self.has_dropped = self._drops
        with self._lock:
            while self._samples and weight < most:
                payload, signature = self._pop()
                if is_burst(signature):
                    taken += self._taken_apart(payload, signature)
                    weight = len(taken)
                else:
                    taken.append((payload.to_bytes() if len(payload) <= self._most_bytes else payload, signature))
                    weight += CHUNK if is_large(taken[-1]) else 1
            self._drops = self._drops and bool(self._samples)
        return taken

    def _put(self, sample: zenoh.Sample) -> None:
        attachment, payload = sample.attachment, sample.payload
        signature = b"" if attachment is None else attachment.to_bytes()
        self._samples.append((payload, signature))
        self._messages += _messages_in(signature)
        self._bytes += len(payload)

    def _pop(self) -> tuple[zenoh.ZBytes, bytes]:
        payload, signature = self._samples.popleft()
        self._messages -= _messages_in(signature)
        self._bytes -= len(payload)
        return payload, signature

    def _taken_apart(self, payload: zenoh.ZBytes, signature: bytes) -> list[Arrived]:
        if len(payload) > MOST_BYTES:
            self._on_malformed(MalformedMessage(f"{len(payload):,} bytes are too many for a burst"))
            return []
        try:
            return [*taken_apart(payload.to_bytes(), signature)]
        except MalformedMessage as error:
            self._on_malformed(error)
            return []


def _messages_in(signature: bytes) -> int:
    return len(signature) // ATTACHMENT_BYTES if is_burst(signature) else 1
