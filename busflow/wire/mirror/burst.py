"""Burst: small messages of one publisher that follow each other closely, sent as one.

Zenoh and its Python take almost the same time for a message of 8 bytes as for one of 8 kB, in both processes. So the
first message leaves at once, and the next ones, until the loop's turn ends, leave together. Each keeps its attachment.
The receiver takes them apart before anything else, so its accounts are those of single messages.

A burst has as attachment those of its messages, one after another. Its payload is the size of each message, as a number
of four bytes, and then the messages.
"""

from __future__ import annotations

import asyncio
import struct
from collections.abc import Callable, Iterable

from busflow.errors import MalformedMessage
from busflow.wire.zenoh.keys import ATTACHMENT_BYTES

_CLOSE_NS = 100_000
"""A message that is published within this time of the one before waits for the end of the loop's turn."""
_MOST = 32
"""Limit of the messages of a burst."""
_SMALL = 1536
"""The largest size of a message in a burst, in bytes: a whole burst is no larger than a message that is sent alone."""
MOST_BYTES = _MOST * (4 + _SMALL)
"""Limit of a whole burst in bytes."""

Signed = tuple[bytes, bytes]
"""A message's payload, and its attachment."""


class BurstSender:
    """Sends one publisher's messages in their order, one by one or in bursts."""

    def __init__(self, send: Callable[[bytes, bytes], None], send_burst: Callable[[bytes, bytes], None]) -> None:
        """Create a sender that sends one by one; both functions take a payload and its attachment."""
        self.is_allowed = False
        """Whether all receivers can read bursts."""
        self._send, self._send_burst = send, send_burst
        self._loop = asyncio.get_running_loop()
        self._waiting: list[Signed] = []
        self._last_ns = 0

    def send(self, payload: bytes, attachment: bytes, now_ns: int) -> None:
        """Send a message now, or at the end of the loop's turn if it closely follows another one."""
        before_ns, self._last_ns = self._last_ns, now_ns
        if not self.is_allowed or now_ns - before_ns > _CLOSE_NS or len(payload) > _SMALL:
            self.flush()
            self._send(payload, attachment)
            return
        if not self._waiting:
            self._loop.call_soon(self.flush)
        self._waiting.append((payload, attachment))
        if len(self._waiting) == _MOST:
            self.flush()

    def flush(self) -> None:
        """Send the messages that wait."""
        if not self._waiting:
            return
        waiting, self._waiting = self._waiting, []
        if len(waiting) > 1 and self.is_allowed:
            self._send_burst(*joined(waiting))
        else:
            for payload, attachment in waiting:
                self._send(payload, attachment)


def joined(messages: Iterable[Signed]) -> Signed:
    """Return messages as one."""
    payloads, attachments = zip(*messages, strict=True)
    sizes = struct.pack(f"<{len(payloads)}I", *map(len, payloads))
    return b"".join((sizes, *payloads)), b"".join(attachments)


def is_burst(attachment: bytes) -> bool:
    """Return whether a message with this attachment is a burst."""
    size = len(attachment)
    return size > ATTACHMENT_BYTES and size % ATTACHMENT_BYTES == 0


def taken_apart(payload: bytes, attachments: bytes) -> list[Signed]:
    """Return the messages of a burst.

    Raises:
        MalformedMessage: The bytes are no burst.
    """
    count = len(attachments) // ATTACHMENT_BYTES
    try:
        if count > _MOST:
            raise MalformedMessage(f"a burst has at most {_MOST} messages; got {count}")
        signatures = struct.unpack(f"{ATTACHMENT_BYTES}s" * count, attachments)
        sizes = struct.unpack_from(f"<{count}I", payload)
    except struct.error as error:
        raise MalformedMessage(f"{len(payload)} and {len(attachments)} bytes are no burst: {error}") from None
    messages: list[Signed] = []
    end = 4 * count
    for signature, size in zip(signatures, sizes, strict=True):
        start, end = end, end + size
        messages.append((payload[start:end], signature))
    if end != len(payload):
        raise MalformedMessage(f"a burst has {end} bytes; got {len(payload)}")
    return messages
