"""Packets: the bytes by which the two ends of a line talk. Numbers are little-endian; the first byte is the kind.

Who receives a topic opens a route for it, under a number that it chooses. What it says about that route afterwards, and
what it receives on it, begins with the kind and this number.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from enum import IntEnum
from typing import Any, NamedTuple

from busflow.bus.qos import Overflow
from busflow.errors import MalformedMessage
from busflow.wire.zenoh.keys import ATTACHMENT_BYTES

VERSION = 1
SMALL = 1536
"""The largest size of a message that leaves together with others, in bytes."""
MOST_TOGETHER = 32
"""Limit of the messages that leave as one packet."""
MOST_BYTES = 64 * 1024
"""No packet is so large."""
_WINDOW = 32
"""Least number of packets that a reader may have to acknowledge."""
PIECES = 2
"""Least number of them that may lie in shared memory."""

_HEAD = struct.Struct("<BI")
_WANTED = struct.Struct("<BIIB")
_CREDIT = struct.Struct("<BII")
_PIECE = struct.Struct(f"<BI{ATTACHMENT_BYTES}sQQ")
_ARENA = struct.Struct("<BQ")
_MARK = struct.Struct(f"<BI{ATTACHMENT_BYTES}sB")
_COUNT_AT, _SIZES_AT = _HEAD.size, _HEAD.size + 1
HEAD_BYTES = _HEAD.size
PAYLOAD_AT = HEAD_BYTES + ATTACHMENT_BYTES
"""Offset of the payload in a packet with one message; its attachment stands before it."""


class Kind(IntEnum):
    """The first byte of a packet."""

    HELLO = 1
    """The first packet of each end: the version of these packets, and the id of its session."""
    OPEN = 2
    """From the reader: it receives a topic from now on."""
    CHANGE = 3
    """From the reader: its deepest queue has changed."""
    CLOSE = 4
    """From the reader: it receives the topic no more."""
    CREDIT = 5
    """From the reader: it has done with so many packets of the route, the oldest first."""
    MESSAGE = 6
    """One message, or the end of one whose beginning came in parts."""
    BURST = 7
    """Several small messages."""
    PIECE = 8
    """One message, which lies in the sender's memory."""
    ARENA = 9
    """The next packet with a descriptor has that of the memory for the pieces which follow."""
    FILE = 10
    """The packet that has the descriptor."""
    PART = 11
    """The beginning of a message, or more of it."""
    MARK = 12
    """The sender has dropped a publisher's messages up to this number, and nothing newer of that publisher follows."""


class Reason(IntEnum):
    """The reason why messages were dropped after the last one that has arrived. It stands in place of a payload."""

    OVERFLOW = 1
    """The reader was behind by more than its queue."""
    END = 2
    """The sender ended before the reader had room."""


class Wanted(NamedTuple):
    """The wish of a reader: the depth and overflow of the deepest queue behind it."""

    depth: int
    overflow: Overflow = Overflow.DROP_OLDEST

    @property
    def window(self) -> int:
        """How many packets the reader may have to acknowledge."""
        return max(self.depth, _WINDOW)

    @property
    def pieces(self) -> int:
        """How many of them may lie in shared memory."""
        return max(self.depth, PIECES)


Signed = tuple[bytes, bytes]
"""A message's payload, and its attachment."""
_OVERFLOWS = (Overflow.DROP_OLDEST, Overflow.DROP_NEWEST)


def hello(session: str) -> bytes:
    """Return the first packet of an end."""
    return bytes((Kind.HELLO, VERSION)) + session.encode()


def read_hello(data: bytes) -> str:
    """Return the id of the session at the other end.

    Raises:
        MalformedMessage: It is no such packet, or of another version.
    """
    if data[0] != Kind.HELLO or data[1:2] != bytes((VERSION,)):
        raise MalformedMessage(f"the first packet of a line names version {VERSION}; got {data[:2].hex()}")
    return data[2:].decode("ascii", "replace")


def opened(number: int, key: str, wanted: Wanted) -> bytes:
    """Return a packet that opens a route for a topic's key."""
    return _wanted(Kind.OPEN, number, wanted) + key.encode()


def changed(number: int, wanted: Wanted) -> bytes:
    """Return a packet that states another depth and overflow."""
    return _wanted(Kind.CHANGE, number, wanted)


def _wanted(kind: Kind, number: int, wanted: Wanted) -> bytes:
    return _WANTED.pack(kind, number, min(wanted.depth, 2**32 - 1), _OVERFLOWS.index(wanted.overflow))


def read_wanted(data: bytes) -> tuple[int, Wanted, str]:
    """Return a route's number, the wish of its reader, and the topic's key, which is empty in a change.

    Raises:
        MalformedMessage: It is no such packet.
    """
    try:
        _, number, depth, overflow = _WANTED.unpack_from(data)
        return number, Wanted(max(depth, 1), _OVERFLOWS[overflow]), data[_WANTED.size :].decode()
    except (struct.error, IndexError, UnicodeDecodeError) as error:
        raise MalformedMessage(f"no route is described by {len(data)} bytes: {error}") from None


def head(kind: Kind, number: int) -> bytes:
    """Return the beginning of a packet of a route."""
    return _HEAD.pack(kind, number)


def number_of(data: bytes) -> int:
    """Return the number of a packet's route.

    Raises:
        MalformedMessage: The packet is too short.
    """
    if len(data) < _HEAD.size:
        raise MalformedMessage(f"a packet of a route has at least {_HEAD.size} bytes; got {len(data)}")
    return _HEAD.unpack_from(data)[1]


def credit(number: int, count: int) -> bytes:
    """Return a packet that acknowledges the route's next `count` packets."""
    return _CREDIT.pack(Kind.CREDIT, number, count)


def read_credit(data: bytes) -> tuple[int, int]:
    """Return a route's number, and how many packets of it are acknowledged.

    Raises:
        MalformedMessage: It is no such packet.
    """
    _, number, count = _unpacked(_CREDIT, data)
    return number, count


def burst(number: int, messages: Sequence[Signed]) -> bytes:
    """Return several small messages as one packet: their number, their sizes, the attachments, and the payloads."""
    payloads, attachments = zip(*messages, strict=True)
    count = len(payloads)
    sizes = struct.pack(f"<BIB{count}H", Kind.BURST, number, count, *map(len, payloads))
    return b"".join((sizes, *attachments, *payloads))


def read_burst(data: bytes) -> list[Signed]:
    """Return the messages of a burst.

    Raises:
        MalformedMessage: The bytes are no burst.
    """
    try:
        count = data[_COUNT_AT]
        signed = struct.unpack_from(f"<{count}H" + f"{ATTACHMENT_BYTES}s" * count, data, _SIZES_AT)
    except (struct.error, IndexError) as error:
        raise MalformedMessage(f"{len(data)} bytes are no burst: {error}") from None
    end = _SIZES_AT + (2 + ATTACHMENT_BYTES) * count
    messages: list[Signed] = []
    for at in range(count):
        start, end = end, end + signed[at]
        messages.append((data[start:end], signed[count + at]))
    if end != len(data):
        raise MalformedMessage(f"a burst has {end} bytes; got {len(data)}")
    return messages


def piece(number: int, attachment: bytes, offset: int, size: int) -> bytes:
    """Return a packet with the place of a message in the sender's memory."""
    return _PIECE.pack(Kind.PIECE, number, attachment, offset, size)


def read_piece(data: bytes) -> tuple[bytes, int, int]:
    """Return a message's attachment, and its offset and size in the sender's memory.

    Raises:
        MalformedMessage: It is no such packet.
    """
    _, _, attachment, offset, size = _unpacked(_PIECE, data)
    return attachment, offset, size


def arena(size: int) -> bytes:
    """Return a packet that announces a descriptor of memory of this size."""
    return _ARENA.pack(Kind.ARENA, size)


def read_arena(data: bytes) -> int:
    """Return the size of the announced memory.

    Raises:
        MalformedMessage: It is no such packet.
    """
    return _unpacked(_ARENA, data)[1]


def mark(number: int, attachment: bytes, reason: Reason) -> bytes:
    """Return a packet that says up to which message a publisher's messages were dropped, and why."""
    return _MARK.pack(Kind.MARK, number, attachment, reason)


def read_mark(data: bytes) -> tuple[Reason, bytes]:
    """Return the reason, and the attachment of the last message that was dropped.

    Raises:
        MalformedMessage: It is no such packet.
    """
    _, _, attachment, reason = _unpacked(_MARK, data)
    try:
        return Reason(reason), attachment
    except ValueError as error:
        raise MalformedMessage(str(error)) from None


def _unpacked(form: struct.Struct, data: bytes) -> tuple[Any, ...]:
    try:
        return form.unpack(data)
    except struct.error as error:
        raise MalformedMessage(f"{len(data)} bytes are no packet of kind {data[0]}: {error}") from None
