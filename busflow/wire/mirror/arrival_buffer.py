"""Arrival buffer: the messages of one topic that have arrived and are not published yet."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import zenoh

from busflow.errors import MalformedMessage
from busflow.wire.mirror.burst import Signed, is_burst, taken_apart
from busflow.wire.zenoh.sender import LARGE


class ArrivalBuffer:
    """Zenoh's ring buffer, in which a burst is one sample, and the messages that are out of it already."""

    def __init__(self, ring: Any, on_malformed: Callable[[MalformedMessage], None]) -> None:
        """Create a buffer of the samples of `ring`; `on_malformed` is called for a burst that cannot be read."""
        self._ring, self._on_malformed = ring, on_malformed
        self._messages: list[Signed] = []

    def wait(self) -> zenoh.Sample:
        """Wait for the next sample and return it, for `put`; in a thread of its own.

        Raises:
            ZError: The subscriber is undeclared, which ends the wait.
        """
        return self._ring.recv()

    def put(self, sample: zenoh.Sample) -> int:
        """Add the messages of a sample, and return the size of its payload."""
        attachment = sample.attachment
        signature = b"" if attachment is None else attachment.to_bytes()
        payload = sample.payload.to_bytes()
        if not is_burst(signature):
            self._messages.append((payload, signature))
        else:
            try:
                self._messages += taken_apart(payload, signature)
            except MalformedMessage as error:
                self._on_malformed(error)
        return len(payload)

    def take(self, most: int) -> list[Signed]:
        """Remove and return up to `most` messages, the oldest first; none if no more have arrived.

        A large message that comes out of the ring is the last: it is handled while the processor has it at hand.
        """
        messages, receive = self._messages, self._ring.try_recv
        try:
            while len(messages) < most and (sample := receive()) is not None:
                if not 0 < self.put(sample) < LARGE:  # what lies in shared memory is large, and has no payload here
                    break
        except zenoh.ZError:
            pass  # the session is closed
        taken = messages[:most]
        del messages[:most]
        return taken
