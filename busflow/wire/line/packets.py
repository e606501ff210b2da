"""Packets: the bytes by which the two ends of a line talk. Numbers are little-endian; the first byte is the kind.

Who receives a topic opens a route for it, under a number that it chooses. What it says about that route afterwards, and
what it receives on it, begins with the kind and this number.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
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
HEAD_BYTES = _HEAD.size
PAYLOAD_AT = HEAD_BYTES + ATTACHMENT_BYTES
"""Offset of the payload in a packet with one message; its attachment stands before it."""
NO_PACKET = (struct.error, LookupError, ValueError)
"""The errors of bytes that are no packet, from all that reads one."""


class Kind(IntEnum):
    """The first byte of a packet."""

    HELLO = 1
    """The first packet of each end: the version of these packets, and the id of its session."""
    OPEN = 2
    """From the reader: it receives a topic from now on; without a topic: its deepest queue has changed."""
    CLOSE = 3
    """From the reader: it receives the topic no more."""
    CREDIT = 4
    """From the reader: it has done with so many packets of the route, the oldest first."""
    MESSAGE = 5
    """One message, or the end of one whose beginning came in parts."""
    BURST = 6
    """Several small messages."""
    PIECE = 7
    """One message, which lies in the sender's memory."""
    ARENA = 8
    """The next packet with a descriptor has that of the memory for the pieces which follow."""
    FILE = 9
    """The packet that has the descriptor."""
    PART = 10
    """The beginning of a message, or more of it."""
    MARK = 11
    """The sender has dropped a publisher's messages up to this number, and nothing newer of that publisher follows."""


class Reason(IntEnum):
    """The reason why messages were dropped after the last one that has arrived. It stands in place of a payload."""

    OVERFLOW = 1
    """The reader was behind by more than its queue."""
    END = 2
    """The sender ended before the reader had room."""
    LINK = 3
    """The line has ended. No packet says so."""


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


_FORMS: Mapping[int, struct.Struct] = {
    Kind.OPEN: struct.Struct("<BIIB"),
    Kind.CREDIT: struct.Struct("<BII"),
    Kind.PIECE: struct.Struct(f"<BI{ATTACHMENT_BYTES}sQQ"),
    Kind.ARENA: struct.Struct("<BQ"),
    Kind.MARK: struct.Struct(f"<BI{ATTACHMENT_BYTES}sB"),
}
"""The forms of the packets whose parts have a fixed size: the kind, and mostly the route's number, come first."""


def packed(kind: Kind, *values: int | bytes) -> bytes:
    """Return a packet of a fixed form."""
    return _FORMS[kind].pack(kind, *values)


def values_of(data: bytes) -> tuple[Any, ...]:
    """Return the values of a packet of a fixed form."""
    return _FORMS[data[0]].unpack(data)[1:]


def hello(session: str) -> bytes:
    """Return the first packet of an end."""
    return bytes((Kind.HELLO, VERSION)) + session.encode()


def read_hello(data: bytes) -> str:
    """Return the id of the session at the other end."""
    if data[:2] != bytes((Kind.HELLO, VERSION)):
        raise MalformedMessage(f"the first packet of a line names version {VERSION}; got {data[:2].hex()}")
    return data[2:].decode("ascii", "replace")


def opened(number: int, key: str, wanted: Wanted) -> bytes:
    """Return a packet that opens a route for a topic's key; without a key, it changes the wish of a route."""
    overflow = _OVERFLOWS.index(wanted.overflow)
    return packed(Kind.OPEN, number, min(wanted.depth, 2**32 - 1), overflow) + key.encode()


def read_opened(data: bytes) -> tuple[int, str, Wanted]:
    """Return a route's number, the topic's key, and the wish of its reader."""
    size = _FORMS[Kind.OPEN].size
    number, depth, overflow = values_of(data[:size])
    return number, data[size:].decode(), Wanted(max(depth, 1), _OVERFLOWS[overflow])


def head(kind: Kind, number: int) -> bytes:
    """Return the beginning of a packet of a route."""
    return _HEAD.pack(kind, number)


def number_of(data: bytes) -> int:
    """Return the number of a packet's route."""
    return _HEAD.unpack_from(data)[1]


def burst(number: int, messages: Sequence[Signed]) -> bytes:
    """Return several small messages as one packet: their number, their sizes, the attachments, and the payloads."""
    payloads, attachments = zip(*messages, strict=True)
    count = len(payloads)
    sizes = struct.pack(f"<BIB{count}H", Kind.BURST, number, count, *map(len, payloads))
    return b"".join((sizes, *attachments, *payloads))


def read_burst(data: bytes) -> list[Signed]:
    """Return the messages of a burst."""
    count = data[HEAD_BYTES]
    signed = struct.unpack_from(f"<{count}H" + f"{ATTACHMENT_BYTES}s" * count, data, HEAD_BYTES + 1)
    end = HEAD_BYTES + 1 + (2 + ATTACHMENT_BYTES) * count
    messages: list[Signed] = []
    for at in range(count):
        start, end = end, end + signed[at]
        messages.append((data[start:end], signed[count + at]))
    if end != len(data):
        raise MalformedMessage(f"a burst has {end} bytes; got {len(data)}")
    return messages
