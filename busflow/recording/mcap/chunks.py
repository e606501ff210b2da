"""Chunks: records that were compressed together, unpacked within limits and checked against their CRC.

A decompressor is imported with the first chunk that needs it.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass
from struct import Struct
from typing import Any

from busflow.errors import BagError
from busflow.recording.mcap.bounds import LARGEST_CHUNK, MOST_PACKED, UNSUSPICIOUS_CHUNK

TIMES = Struct("<QQ")
"""The first fields of a chunk: the log times of its first and last message."""
_HEAD = Struct("<QQQII")
_LENGTH = Struct("<Q")
_LONGEST_NAME = 32


class _Wrong(Exception):
    """A chunk cannot be unpacked."""


@dataclass(frozen=True, slots=True)
class Chunk:
    """A chunk as it lies in the file."""

    start_ns: int
    end_ns: int
    size: int
    """Bytes when it is unpacked."""
    crc: int
    """0 means none."""
    compression: str
    packed: memoryview


def unpacked(body: bytes, file: str, offset: int) -> bytes:
    """Return the records of a chunk.

    Raises:
        BagError: It is too large, does not match its CRC, or has an unknown compression.
    """
    chunk = chunk_of(body, file, offset)
    try:
        return _data(chunk)
    except _Wrong as wrong:
        raise BagError(f"a chunk is damaged: {wrong}", file=file, offset=offset) from None


def chunk_of(body: bytes, file: str, offset: int) -> Chunk:
    """Return a chunk as it lies in the file.

    Raises:
        BagError: It is cut off, or would be too large.
    """
    try:
        return _chunk(body)
    except _Wrong as wrong:
        raise BagError(f"a chunk is damaged: {wrong}", file=file, offset=offset) from None


def _chunk(body: bytes) -> Chunk:
    if len(body) < _HEAD.size:
        raise _Wrong("it is cut off")
    start_ns, end_ns, size, crc, length = _HEAD.unpack_from(body)
    at = _HEAD.size + length
    if length > _LONGEST_NAME or len(body) < at + _LENGTH.size:
        raise _Wrong("it is cut off")
    compression = body[_HEAD.size : at].decode("ascii", "backslashreplace")
    (packed,) = _LENGTH.unpack_from(body, at)
    at += _LENGTH.size
    if packed > len(body) - at:
        raise _Wrong(f"it announces {packed} bytes where {len(body) - at} are left")
    if size > LARGEST_CHUNK:
        raise _Wrong(f"it would be {size} bytes when unpacked, and {LARGEST_CHUNK} are allowed")
    if size > max(UNSUSPICIOUS_CHUNK, MOST_PACKED * packed):
        raise _Wrong(f"{packed} bytes would become {size}, which nothing that was recorded does")
    return Chunk(start_ns, end_ns, size, crc, compression, memoryview(body)[at : at + packed])


def _data(chunk: Chunk) -> bytes:
    unpack = _UNPACK.get(chunk.compression)
    if unpack is None:
        raise _Wrong(f"it is packed as {chunk.compression!r}; zstd and lz4 are read")
    data = unpack(chunk) if chunk.size or chunk.packed else b""
    if len(data) != chunk.size:
        raise _Wrong(f"it holds {len(data)} bytes where it announces {chunk.size}")
    if chunk.crc and chunk.crc != zlib.crc32(data):
        raise _Wrong("it is not what its CRC stands for")
    return data


def _zstd(chunk: Chunk) -> bytes:
    import zstandard

    try:
        # The size that the frame itself states is what would be allocated, whatever limit is given.
        stated = zstandard.frame_content_size(chunk.packed)
        if stated not in (-1, chunk.size):
            raise _Wrong(f"it would be {stated} bytes when unpacked where it announces {chunk.size}")
        return zstandard.ZstdDecompressor().decompress(chunk.packed, max_output_size=chunk.size or 1)
    except zstandard.ZstdError as error:
        raise _Wrong(f"zstd says: {error}") from None


def _lz4(chunk: Chunk) -> bytes:
    import lz4.frame  # pyright: ignore[reportMissingTypeStubs]  # it has none

    reader: Any = lz4.frame.LZ4FrameDecompressor()
    try:
        data: bytes = reader.decompress(chunk.packed, max_length=chunk.size + 1)
    except (RuntimeError, EOFError) as error:
        raise _Wrong(f"lz4 says: {error}") from None
    if len(data) == chunk.size and not reader.eof:
        data += reader.decompress(b"", max_length=1)  # the mark of its end alone may be left
    return data


_UNPACK: dict[str, Callable[[Chunk], bytes]] = {
    "": lambda chunk: bytes(chunk.packed),
    "zstd": _zstd,
    "lz4": _lz4,
}
