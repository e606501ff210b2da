"""Place: where a message stands in the memory of another process, in the form that travels."""

from __future__ import annotations

import struct
from typing import NamedTuple

from busflow.errors import MalformedMessage

KEY_BYTES = 16
_PLACE = struct.Struct(f"<IIQQ{KEY_BYTES}s")
PLACE_BYTES = _PLACE.size


class MemoryPlace(NamedTuple):
    """Where a message stands."""

    pid: int
    fd: int
    """The descriptor of the arena in that process."""
    position: int
    """Number of bytes that were written before it since the arena was made."""
    size: int
    key: bytes
    """The arena's key, by which a reader knows that it has opened the right memory."""

    def encode(self) -> bytes:
        """Return the bytes that travel."""
        return _PLACE.pack(*self)

    @classmethod
    def decode(cls, data: bytes) -> MemoryPlace:
        """Decode bytes from another process.

        Raises:
            MalformedMessage: They are not a place.
        """
        if len(data) != PLACE_BYTES:
            raise MalformedMessage(f"a place in shared memory has {PLACE_BYTES} bytes; got {len(data)}")
        return cls._make(_PLACE.unpack(data))
