"""Crossing: messages from one process to another, over busflow and over what else there is.

Each way has a *sender* and a *receiver*, which a board in shared memory connects: who hears notes there what arrived
and when, so that measuring adds nothing to what goes over the way itself. `System-wide` time is the monotonic clock's,
which all processes of a machine share.
"""

from __future__ import annotations

SIZES = {"8 B": 8, "320 B": 320, "64 KB": 65_536, "1 MB": 1 << 20, "6 MB": 6_220_800}
RATES_HZ = {8: 1000, 320: 1000, 65_536: 1000, 1 << 20: 200, 6_220_800: 40}
"""Messages a second while latency is measured."""
WINDOWS = {8: 2048, 320: 2048, 65_536: 64, 1 << 20: 12, 6_220_800: 6}
"""How many messages may be under way while the rate is measured: nobody is flooded, and nothing is lost."""

RING = 8
"""So many messages are made beforehand and sent in turn; the first byte of each is its number."""
FLOOD = 100
"""The first byte of the messages by which the rate is measured."""
HELLO = 101
"""The first byte of the messages that are sent until one of them arrives."""


def payload(size: int, number: int) -> bytes:
    """A message of so many bytes."""
    return bytes([number]) + bytes(size - 1)
