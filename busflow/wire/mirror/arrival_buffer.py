"""Arrival buffer: the messages of one topic that have arrived and are not published yet."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import Any

import zenoh

from busflow.errors import MalformedMessage
from busflow.wire.mirror.burst import MOST_BYTES, is_burst, taken_apart
from busflow.wire.zenoh.keys import ATTACHMENT_BYTES
from busflow.wire.zenoh.sender import LARGE, LARGEST

Arrived = tuple[bytes | zenoh.ZBytes, bytes]
"""A message's payload, and its attachment. A payload too large for the topic's type is not copied: it stays Zenoh's."""


def is_large(message: Arrived) -> bool:
    """Return whether a message is large, or lies in shared memory, where all are."""
    payload, signature = message
    return len(payload) >= LARGE or len(signature) > ATTACHMENT_BYTES


class ArrivalBuffer:
    """Zenoh's ring buffer, in which a burst is one sample, and the messages that are out of it already.

    The ring limits the number of samples, and in a thread of Zenoh, which never waits for the interpreter's lock. It
    knows no limit in bytes. So while the loop is busy for long, another thread calls `limit`.
    """

    def __init__(
        self, ring: Any, depth: int, most_bytes: float, on_malformed: Callable[[MalformedMessage], None]
    ) -> None:
        """Create an empty buffer.

        Args:
            ring: the handler of a subscriber with a ring buffer.
            depth: the number of samples in the ring.
            most_bytes: the size of the largest message that the topic can have.
            on_malformed: called for a burst that cannot be read.
        """
        self._ring, self._most_bytes, self._on_malformed = ring, most_bytes, on_malformed
        self._waiting = deque[zenoh.Sample](maxlen=depth)
        """Samples that `limit` has taken from the ring."""
        self._lock, self._has_dropped = threading.Lock(), False
        self._messages: list[Arrived] = []

    def wait(self) -> zenoh.Sample:
        """Wait for the next sample and return it, for `put`; in a thread of its own.

        Raises:
            ZError: The subscriber is undeclared, which ends the wait.
        """
        with self._lock:
            if self._waiting:
                return self._waiting.popleft()
        return self._ring.recv()

    def limit(self) -> bool:
        """Drop the oldest samples beyond `LARGEST` bytes; return whether some were dropped for the first time.

        One sample is kept, however large. Those that were dropped are missing numbers, and so count as lost.
        """
        before = self._has_dropped
        with self._lock:
            while (sample := self._ring.try_recv()) is not None:
                self._waiting.append(sample)
            size = sum(len(each.payload) for each in self._waiting)
            while size > LARGEST and len(self._waiting) > 1:
                size -= len(self._waiting.popleft().payload)
                self._has_dropped = True
        return self._has_dropped and not before

    def put(self, sample: zenoh.Sample) -> int:
        """Add the messages of a sample, and return the size of its payload."""
        attachment, payload = sample.attachment, sample.payload
        signature = b"" if attachment is None else attachment.to_bytes()
        size = len(payload)
        if not is_burst(signature):
            self._messages.append((payload.to_bytes() if size <= self._most_bytes else payload, signature))
        elif size > MOST_BYTES:
            self._on_malformed(MalformedMessage(f"{size:,} bytes are too many for a burst"))
        else:
            try:
                self._messages += taken_apart(payload.to_bytes(), signature)
            except MalformedMessage as error:
                self._on_malformed(error)
        return size

    def take(self, most: int) -> list[Arrived]:
        """Remove and return up to `most` messages, the oldest first; none if no more have arrived.

        A large one, or as many bytes, comes last out of the ring: it is handled while the processor has it at hand.
        """
        messages, size = self._messages, sum(len(payload) for payload, _ in self._messages)
        try:
            with self._lock:
                while len(messages) < most and size < LARGE and (sample := self._next()) is not None:
                    size += self.put(sample) or LARGE  # what lies in shared memory is large, and has no payload here
        except zenoh.ZError:
            pass  # the session is closed
        taken = messages[:most]
        del messages[:most]
        return taken

    def _next(self) -> zenoh.Sample | None:
        return self._waiting.popleft() if self._waiting else self._ring.try_recv()
