"""Arena: memory without a file, in which a process writes its large messages for all others to read."""

from __future__ import annotations

import fcntl
import mmap
import os
import sys
import weakref
from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

NAME = "busflow"
"""The name under which the system lists the memory; it cannot be opened by this name."""
CAPACITY = 256 << 20
"""Limit of the messages that lie in one arena, in bytes. A page takes memory only once it was written."""
_PAGE = mmap.PAGESIZE


@dataclass(frozen=True, slots=True)
class Pieces:
    """An encoded message whose large arrays are not copied yet."""

    pieces: Sequence[Any]
    size: int

    @property
    def joined(self) -> bytes:
        """The message as bytes."""
        return b"".join(self.pieces)


def _mapped(fd: int, size: int, protection: int) -> mmap.mmap:
    """Map memory; before Python 3.13 that takes a descriptor more for as long as it is mapped."""
    if sys.version_info >= (3, 13):
        return mmap.mmap(fd, size, prot=protection, trackfd=False)
    return mmap.mmap(fd, size, prot=protection)


class Places:
    """The free and the taken places of an arena. A place is taken by first fit, so those in use stay few and warm."""

    def __init__(self, capacity: int) -> None:
        """Create places that are all free."""
        self.capacity = capacity
        self.taken: int = 0
        """Bytes that are taken."""
        self._starts, self._ends = [0], [capacity]
        """Where each free place begins and ends, in their order. No two of them touch."""

    @property
    def end(self) -> int:
        """The end of the last place that is taken."""
        is_last_free = bool(self._ends) and self._ends[-1] == self.capacity
        return self._starts[-1] if is_last_free else self.capacity

    def take(self, size: int) -> int | None:
        """Take whole pages for `size` bytes, and return their offset; None if there is no room."""
        room = _whole_pages(size)
        for at, (start, end) in enumerate(zip(self._starts, self._ends, strict=True)):
            if end - start >= room:
                if end - start == room:
                    del self._starts[at], self._ends[at]
                else:
                    self._starts[at] += room
                self.taken += room
                return start
        return None

    def free(self, offset: int, size: int) -> None:
        """Free a place that was taken."""
        end = offset + _whole_pages(size)
        self.taken -= end - offset
        at = bisect_left(self._starts, offset)
        joins_next = at < len(self._starts) and self._starts[at] == end
        joins_last = at > 0 and self._ends[at - 1] == offset
        if joins_last and joins_next:
            self._ends[at - 1] = self._ends.pop(at)
            del self._starts[at]
        elif joins_last:
            self._ends[at - 1] = end
        elif joins_next:
            self._starts[at] = offset
        else:
            self._starts.insert(at, offset)
            self._ends.insert(at, end)


def _whole_pages(size: int) -> int:
    return max(-(-size // _PAGE), 1) * _PAGE


class Arena:
    """Memory without a file. The kernel frees it when the last process that has it open has ended or closed it."""

    def __init__(self, capacity: int = CAPACITY) -> None:
        """Make an arena for so many bytes of messages.

        Raises:
            OSError: The system has no such memory, or not so much.
        """
        self.fd: int = os.memfd_create(NAME, os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        weakref.finalize(self, os.close, self.fd)
        os.fchmod(self.fd, 0o600)
        os.ftruncate(self.fd, capacity)
        # If the memory could shrink, that would kill a process that reads it.
        fcntl.fcntl(self.fd, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL)
        self._map = _mapped(self.fd, capacity, mmap.PROT_READ | mmap.PROT_WRITE)
        self._memory = memoryview(self._map)
        self._places = Places(capacity)
        self._written = self._peak = 0
        """Ends of the pages that were written ever, and since the last `trim`."""

    @property
    def capacity(self) -> int:
        """Size of the whole in bytes."""
        return self._places.capacity

    @property
    def taken(self) -> int:
        """Bytes of messages that a reader may still read, in whole pages."""
        return self._places.taken

    @property
    def written(self) -> int:
        """Bytes of memory that it takes."""
        return self._written

    def trim(self) -> None:
        """Give back the memory that no message has needed since the last call."""
        kept = max(self._peak, self._places.end)
        if kept < self._written:
            self._map.madvise(mmap.MADV_REMOVE, kept, self._written - kept)
            self._written = kept
        self._peak = self._places.end

    def store(self, payload: bytes | Pieces) -> Stored | None:
        """Write a message; None if there is no room."""
        pieces, size = (payload.pieces, payload.size) if isinstance(payload, Pieces) else ((payload,), len(payload))
        offset = self._places.take(size)
        if offset is None:
            return None
        at = offset
        for piece in pieces:
            data = memoryview(piece).cast("B")
            self._memory[at : at + len(data)] = data
            at += len(data)
        self._peak = max(self._peak, offset + _whole_pages(size))
        self._written = max(self._written, self._peak)
        return Stored(self, offset, size)

    def free(self, stored: Stored) -> None:
        """Free the place of a message that nobody reads any more."""
        self._places.free(stored.offset, stored.size)


class Stored:
    """A message in an arena. It lies there until each of its holders has released it."""

    __slots__ = ("_holders", "arena", "offset", "size")

    def __init__(self, arena: Arena, offset: int, size: int) -> None:
        """Create a message with one holder: the one who has written it."""
        self.arena: Arena = arena
        self.offset: int = offset
        self.size: int = size
        self._holders = 1

    def __len__(self) -> int:
        return self.size

    @property
    def is_held(self) -> bool:
        """Whether it still lies in its arena."""
        return self._holders > 0

    def hold(self) -> None:
        """Add a holder."""
        self._holders += 1

    def release(self) -> None:
        """Remove a holder; without any, its place is free."""
        self._holders -= 1
        if not self._holders:
            self.arena.free(self)


class ForeignArena:
    """The arena of another process, mapped here to read."""

    def __init__(self, fd: int, size: int) -> None:
        """Map memory by its descriptor, which the caller closes.

        Raises:
            OSError: It cannot be mapped, it is smaller than stated, or it could shrink.
        """
        sealed = fcntl.fcntl(fd, fcntl.F_GET_SEALS) & fcntl.F_SEAL_SHRINK
        if not sealed or not 0 < size <= os.fstat(fd).st_size:
            raise OSError("the memory that it names could shrink, or is smaller than it says")
        self.size = size
        self._memory = _mapped(fd, size, mmap.PROT_READ)

    def read(self, offset: int, size: int) -> bytes:
        """Return a copy of a message."""
        return self._memory[offset : offset + size]


class Piece:
    """A message that lies in the memory of another process, until it is acknowledged."""

    __slots__ = ("_arena", "_offset", "size")

    def __init__(self, arena: ForeignArena, offset: int, size: int) -> None:
        """Create a piece; the place lies within the arena."""
        self._arena, self._offset = arena, offset
        self.size: int = size

    def __len__(self) -> int:
        return self.size

    def to_bytes(self) -> bytes:
        """Return a copy of the message. Read it before you acknowledge it: its place is used again afterwards."""
        return self._arena.read(self._offset, self.size)
