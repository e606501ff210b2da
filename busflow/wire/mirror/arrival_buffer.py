"""Arrival buffer: the messages of one topic that have arrived, by whatever way, and are not published yet."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Container, Iterable
from typing import TYPE_CHECKING, Union

import zenoh

from busflow.wire.line.packets import Reason
from busflow.wire.zenoh.keys import GID_AT
from busflow.wire.zenoh.sender import LARGE

if TYPE_CHECKING:
    from busflow.wire.line.arena import Piece
    from busflow.wire.line.intake import Intake

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
    """The messages of intakes and of Zenoh, in the order in which they came; used on the loop alone.

    A payload is copied when its message is taken; a message that is skipped is not copied.
    """

    def __init__(self, most_bytes: float) -> None:
        """Create an empty buffer; `most_bytes` is the size of the largest message that the topic can have."""
        self._most_bytes = most_bytes
        self._arrived = deque[tuple[Payload, bytes, "Intake | None"]]()
        self._left: list[Intake | None] = []
        """The intakes of the messages that have left the buffer and are not acknowledged."""

    def __len__(self) -> int:
        """Return the number of messages that wait."""
        return len(self._arrived)

    def put(self, arrived: Iterable[Arrived], intake: Intake | None) -> None:
        """Add the messages of an intake, or of Zenoh."""
        self._arrived.extend([(payload, signature, intake) for payload, signature in arrived])

    def skip(self, keep: int, publishers: Container[bytes]) -> list[bytes]:
        """Remove messages of these publishers that are older than the newest `keep`; return their attachments.

        It stops at the first message of another publisher.
        """
        skipped: list[bytes] = []
        while len(self._arrived) > keep:
            payload, signature, intake = self._arrived[0]
            if isinstance(payload, Reason) or signature[GID_AT:] not in publishers:
                break
            self._arrived.popleft()
            self._left.append(intake)
            skipped.append(signature)
        return skipped

    def take(self, most: float = CHUNK) -> list[Arrived]:
        """Remove and return up to `most` of the oldest messages."""
        taken: list[Arrived] = []
        weight, arrived = 0, self._arrived
        while arrived and weight < most:
            payload, signature, intake = arrived.popleft()
            if not isinstance(payload, _AS_IT_IS) and len(payload) <= self._most_bytes:
                payload = payload.to_bytes()
            message = payload, signature
            taken.append(message)
            self._left.append(intake)
            weight += CHUNK if is_large(message) else 1
        return taken

    def acknowledge(self) -> None:
        """Let the senders know how many of their messages have left."""
        if self._left:
            counts, self._left = Counter(self._left), []
            for intake, count in counts.items():
                if intake is not None:
                    intake.acknowledge(count)

    def discard(self, intake: Intake) -> None:
        """Remove the messages of an intake that is about to close: their memory is used again."""
        self._arrived = deque(each for each in self._arrived if each[2] is not intake)
