"""Listener: the messages of one topic as they arrive at a client, with counts of those it missed."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

from busflow.errors import MalformedMessage
from busflow.wire.zenoh.keys import MOST_MISSING, Attachment

if TYPE_CHECKING:
    import zenoh

MOST_BYTES = 64 * 1024 * 1024
"""Limit of the bytes that wait to be read, whatever their number; a single larger message may wait."""


class Received(NamedTuple):
    """One message as it arrived. A named tuple, because one is made for every message."""

    payload: bytes
    sequence: int
    """Number among its publisher's messages, from 1; 0 if it is not stated."""
    stamp_ns: int
    """Publication time by the publisher's clock; 0 if it is not stated."""
    gid: bytes

    @classmethod
    def of(cls, sample: zenoh.Sample) -> Received:
        """Convert a sample of Zenoh."""
        attachment = sample.attachment
        try:
            found = Attachment.decode(attachment.to_bytes()) if attachment is not None else Attachment(0, 0, b"")
        except MalformedMessage:  # a message signed in another way is received too
            found = Attachment(0, 0, b"")
        return cls(sample.payload.to_bytes(), found.sequence, found.stamp_ns, found.gid)


class Listener:
    """Messages of one topic, as they arrive."""

    def __init__(
        self, depth: int, *, most_bytes: int = MOST_BYTES, on_arrival: Callable[[], None] | None = None
    ) -> None:
        """Make a queue that is bounded in messages and in bytes.

        Args:
            depth: how many messages may wait.
            most_bytes: how large they may be together; a single larger one may wait.
            on_arrival: called in Zenoh's thread when a message arrives and none waited before.
        """
        self.dropped: int = 0
        """Messages that were not read in time."""
        self.lost: int = 0
        """Messages that never arrived: gaps in a publisher's sequence."""
        self._depth, self._most_bytes, self._on_arrival = depth, most_bytes, on_arrival
        self._waiting: deque[Received] = deque()
        self._bytes = 0
        self._arrived = threading.Condition()
        self._sequences: dict[bytes, int] = {}

    def put(self, sample: zenoh.Sample) -> None:
        """Add a message; called in Zenoh's thread."""
        received = Received.of(sample)
        size = len(received.payload)
        with self._arrived:
            self._count_lost(received)
            is_first = not self._waiting
            while self._waiting and (len(self._waiting) >= self._depth or self._bytes + size > self._most_bytes):
                self._bytes -= len(self._waiting.popleft().payload)
                self.dropped += 1
            self._waiting.append(received)
            self._bytes += size
            self._arrived.notify()
        if is_first and self._on_arrival is not None:
            self._on_arrival()

    def get(self, timeout_s: float | None = None) -> Received | None:
        """Wait for the next message and return it; None if none came in time."""
        if timeout_s == 0 and not self._waiting:  # most looks of one who has many listeners find nothing
            return None
        with self._arrived:
            if not self._waiting and not self._arrived.wait_for(lambda: self._waiting, timeout_s):
                return None
            received = self._waiting.popleft()
            self._bytes -= len(received.payload)
        return received

    def _count_lost(self, received: Received) -> None:
        if received.sequence:
            last = self._sequences.get(received.gid)
            if last is not None and 0 < (missing := received.sequence - last - 1) <= MOST_MISSING:
                self.lost += missing
            self._sequences[received.gid] = received.sequence
