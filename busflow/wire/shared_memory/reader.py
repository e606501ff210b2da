"""Reader: copies messages out of the memory of other processes."""

from __future__ import annotations

import fcntl
import mmap
import os
from pathlib import Path

from busflow.wire.shared_memory.arena import HEADER_BYTES, MARKS, MOST_BYTES, NAME, WRITTEN, words
from busflow.wire.shared_memory.place import KEY_BYTES, MemoryPlace
from busflow.wire.shared_memory.writer import reader_id


class MemoryReader:
    """Reads one publisher's messages, and keeps the arena of the last one open."""

    def __init__(self, session: str) -> None:
        """Create a reader that marks in the arena how far this session has read."""
        self._id = reader_id(session)
        self._key = b""
        self._arena: _OpenArena | None = None

    def read(self, place: MemoryPlace) -> bytes | None:
        """Return a copy of a message; None if newer ones have overwritten it, or if its publisher has ended.

        Raises:
            OSError: This process must not open the memory of the other one.
        """
        if place.key != self._key:
            memory = _opened(place)
            self._arena, self._key = None if memory is None else _OpenArena(memory, self._id), place.key
        return None if self._arena is None else self._arena.read(place)


class _OpenArena:
    """The arena of another process, mapped here."""

    def __init__(self, memory: mmap.mmap, reader: int) -> None:
        self._memory, self._words, self._reader = memory, words(memory), reader
        self._mark = -1

    def read(self, place: MemoryPlace) -> bytes | None:
        start = HEADER_BYTES + place.position % (len(self._memory) - HEADER_BYTES)
        # A reader that is behind does not copy what is gone.
        data = self._memory[start : start + place.size] if self._has(place) else b""
        is_whole = len(data) == place.size and self._has(place)
        self._mark_read(place.position + place.size)
        return data if is_whole else None

    def _mark_read(self, position: int) -> None:
        """Mark that messages up to here are read; if all marks are taken, the publisher soon waits no more."""
        marks = self._words
        if self._mark < 0 or marks[self._mark] != self._reader:  # the publisher removes marks it does not know
            free = [at for wanted in (self._reader, 0) for at in MARKS if marks[at] == wanted]
            if not free:
                return
            self._mark = free[0]
        marks[self._mark + 1] = position
        marks[self._mark] = self._reader

    def _has(self, place: MemoryPlace) -> bool:
        """Return whether a message is written and not overwritten."""
        capacity = len(self._memory) - HEADER_BYTES
        return place.position + place.size <= self._words[WRITTEN] <= place.position + capacity


def _opened(place: MemoryPlace) -> mmap.mmap | None:
    """Map the arena of a place; None if it has gone, or if there is something else."""
    path = Path(f"/proc/{place.pid}/fd/{place.fd}")
    try:
        # A message could name any file of another process; opening some has effects.
        if not str(path.readlink()).startswith(f"/memfd:{NAME} "):
            return None
        fd = os.open(path, os.O_RDWR | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    try:
        size = os.fstat(fd).st_size
        if not HEADER_BYTES < size <= HEADER_BYTES + MOST_BYTES or not _is_sealed(fd):
            return None
        memory = mmap.mmap(fd, size)
    finally:
        os.close(fd)
    return memory if memory[:KEY_BYTES] == place.key else None


def _is_sealed(fd: int) -> bool:
    """Return whether the memory can never shrink."""
    return bool(fcntl.fcntl(fd, fcntl.F_GET_SEALS) & fcntl.F_SEAL_SHRINK)
