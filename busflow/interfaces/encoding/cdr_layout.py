"""Layout: where a run of values of fixed size lies in a message, given where it begins.

A run is packed and unpacked by one `struct` format. Its padding depends on the offset at which it begins, modulo 8;
where that is not known in advance, there is a format for each. Offsets count the 4 bytes of the header, alignment does
not.
"""

from __future__ import annotations

from collections.abc import Sequence
from struct import Struct
from typing import NamedTuple

HEADER = b"\0\1\0\0"
"""The header of busflow's messages: plain CDR, little endian."""

BIG_ENDIAN = b"\0\0"
"""The header of a big-endian message."""

HEADER_SIZE = 4

SPARE = 3
"""Bytes that may follow a message: ROS 2's transport fills up to a multiple of 4."""


class Item(NamedTuple):
    """One value of a run: what `struct` calls it, its alignment and the bytes it takes."""

    code: str
    alignment: int
    size: int


def padding(offset: int, alignment: int) -> int:
    """Return the number of padding bytes between an offset and the next one that is aligned.

    >>> padding(4, 8), padding(5, 4), padding(8, 8)
    (0, 3, 4)
    """
    return (HEADER_SIZE - offset) % alignment


def packed(items: Sequence[Item], offset: int, order: str) -> Struct:
    """Return the `struct` format of the run when it begins at this offset, in the byte order `<` or `>`.

    >>> run = [Item("B", 1, 1), Item("d", 8, 8)]
    >>> packed(run, 4, "<").format, packed(run, 7, "<").format
    ('<B7xd', '<B4xd')
    """
    parts, at = [order], offset
    for item in items:
        gap = padding(at, item.alignment)
        parts.append(f"{gap}x{item.code}" if gap else item.code)
        at += gap + item.size
    return Struct("".join(parts))


def alignment(items: Sequence[Item]) -> int:
    """Return the strictest alignment of a run: its padding is the same wherever it begins modulo this.

    >>> alignment([Item("B", 1, 1), Item("d", 8, 8)])
    8
    """
    return max((item.alignment for item in items), default=1)
