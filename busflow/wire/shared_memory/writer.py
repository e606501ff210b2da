"""Writer: writes one publisher's messages into shared memory, while all receivers of its topic can read that."""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.clock import perf_counter, sleep

if TYPE_CHECKING:
    from busflow.wire.shared_memory.arena import Arena, Arenas
    from busflow.wire.shared_memory.place import MemoryPlace

_LEAST_MESSAGES = 4
"""An arena with room for fewer messages than this is replaced by a larger one."""
_PAUSE_S = 0.0002


class MemoryWriter:
    """Writes a publisher's messages into its arena, which it makes with the first one."""

    def __init__(self, arenas: Arenas) -> None:
        self._arenas = arenas
        self._arena: Arena | None = None
        self._readers: dict[int, int] = {}
        """By reader, the position in the arena from which on it gets messages."""
        self._changing = threading.Lock()
        """Held while the arena or its readers change: messages are written in the sender's thread too."""
        self._stalled: set[int] = set()

    def share(self, sessions: Collection[str]) -> None:
        """Write for the readers of these sessions from now on; without any, write nothing."""
        with self._changing:
            position = self._arena.position if self._arena is not None else 0
            self._readers = {reader: self._readers.get(reader, position) for reader in map(reader_id, sessions)}
            if self._arena is not None:
                self._arena.clear_marks(self._readers)

    @property
    def has_readers(self) -> bool:
        """Whether messages are written at all."""
        return bool(self._readers)

    def is_ready(self, size: int) -> bool:
        """Return whether a message of `size` bytes can be written without waiting for a reader."""
        arena = self._arena
        if arena is None or arena.capacity < _LEAST_MESSAGES * size or not self._readers:
            return False
        return arena.behind(self._readers, size) <= self._stalled

    def write(self, pieces: Sequence[Any], size: int) -> MemoryPlace | None:
        """Write a message, after waiting for readers that are behind; None if it has to be sent in another way."""
        arena = self._arena
        if not self._readers:
            return None
        if arena is None or arena.capacity < _LEAST_MESSAGES * size:
            arena = self._arenas.make(size)
            if arena is None:
                return None
            with self._changing:
                self._arena, self._readers = arena, dict.fromkeys(self._readers, 0)
        self._wait(arena, size)
        return arena.write(pieces, size)

    def _wait(self, arena: Arena, size: int) -> None:
        until = perf_counter() + timeouts.current.slow_reader
        while behind := arena.behind(self._readers, size):
            self._stalled &= behind
            if behind == self._stalled:
                return
            if perf_counter() > until:
                self._stalled |= behind
            else:
                sleep(_PAUSE_S)
        self._stalled.clear()


def reader_id(session: str) -> int:
    """Return the number with which a session marks how far it has read; 0 marks nothing."""
    return int.from_bytes(hashlib.blake2b(session.encode(), digest_size=8).digest()) or 1
