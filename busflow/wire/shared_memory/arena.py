"""Arena: memory in which one publisher's messages follow one another, for other processes to read."""

from __future__ import annotations

import fcntl
import mmap
import os
import weakref
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from busflow.wire.shared_memory.place import KEY_BYTES, MemoryPlace

HEADER_BYTES = 4096
"""Size of the page before the messages, which consists of words of eight bytes. Both sides see each word whole, as the
processor reads and writes it at once: the two words of the key, and those below.
"""
WRITTEN = KEY_BYTES // 8
"""Index of the word with the position up to which messages are written."""
MARKS = range(8, 72, 2)
"""Indices of the readers' marks, of two words: its id, and the position up to which it has read."""
NAME = "busflow"
"""The name under which the system lists the memory; it cannot be opened by this name."""
MOST_BYTES = 256 << 20
"""Limit of the arenas of one process, together."""
_LEAST_BYTES, _USUAL_BYTES = 1 << 20, 64 << 20
_LEAST_MESSAGES, _USUAL_MESSAGES = 8, 16
"""Number of messages for which an arena has room: as many as an inlet has for images and clouds."""


class Arena:
    """Memory without a file. The kernel frees it when the last process that has it open has ended or closed it."""

    def __init__(self, capacity: int) -> None:
        """Make an arena for so many bytes of messages.

        Raises:
            OSError: The system has no such memory, or not so much.
        """
        self.capacity = capacity
        self._key = os.urandom(KEY_BYTES)
        self._fd = os.memfd_create(NAME, os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        weakref.finalize(self, os.close, self._fd)
        os.fchmod(self._fd, 0o600)
        os.ftruncate(self._fd, HEADER_BYTES + capacity)
        # If the memory could shrink, that would kill a process that reads it.
        fcntl.fcntl(self._fd, fcntl.F_ADD_SEALS, fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL)
        memory = mmap.mmap(self._fd, HEADER_BYTES + capacity)
        memory[:KEY_BYTES] = self._key
        self._words = words(memory)
        self._room = np.frombuffer(memory, np.uint8, offset=HEADER_BYTES)
        self._position = 0

    @property
    def position(self) -> int:
        """The position up to which messages are written."""
        return self._position

    def behind(self, readers: Mapping[int, int], size: int) -> set[int]:
        """Return the readers that have not read yet what the next message of `size` bytes overwrites.

        Args:
            readers: by reader, the position from which on it gets messages.
            size: the size of the next message.
        """
        words, kept = self._words, self._start(size) + size - self.capacity
        marks = {words[at]: words[at + 1] for at in MARKS}
        return {reader for reader, since in readers.items() if max(marks.get(reader, 0), since) < kept}

    def write(self, pieces: Sequence[Any], size: int) -> MemoryPlace:
        """Write a message of `size` bytes, at most the capacity; it overwrites the oldest messages."""
        position = self._start(size)
        # A reader that copies a message looks here afterwards: it must see first that this is being overwritten.
        self._words[WRITTEN] = position + size
        start = position % self.capacity
        for piece in pieces:
            data = np.frombuffer(piece, np.uint8)
            self._room[start : start + len(data)] = data  # numpy lets other threads run while it copies much
            start += len(data)
        self._position = position + size
        return MemoryPlace(os.getpid(), self._fd, position, size, self._key)

    def clear_marks(self, readers: Collection[int]) -> None:
        """Remove the marks of all but these readers."""
        for at in MARKS:
            if self._words[at] not in readers:
                self._words[at] = 0

    def _start(self, size: int) -> int:
        """Return the position of the next message of `size` bytes, which lies in one piece."""
        left = self.capacity - self._position % self.capacity
        return self._position if size <= left else self._position + left


def words(memory: mmap.mmap) -> memoryview[int]:
    """Return the words of the page before the messages."""
    return memoryview(memory)[:HEADER_BYTES].cast("Q")


class Arenas:
    """The arenas of one process."""

    def __init__(self) -> None:
        self._arenas: weakref.WeakSet[Arena] = weakref.WeakSet()

    @property
    def capacity(self) -> int:
        """Bytes that all of them have room for."""
        return sum(arena.capacity for arena in tuple(self._arenas))

    def make(self, size: int) -> Arena | None:
        """Make an arena for messages of about `size` bytes; None if the limit is reached, or the system refuses."""
        capacity = max(_LEAST_BYTES, min(_USUAL_MESSAGES * size, _USUAL_BYTES), _LEAST_MESSAGES * size)
        if self.capacity + capacity > MOST_BYTES:
            return None
        try:
            arena = Arena(capacity)
        except OSError:
            return None
        self._arenas.add(arena)
        return arena
