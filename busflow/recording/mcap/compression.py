"""Compression: the words for it, and how the parts of a chunk become the bytes in the file."""

# Neither library has stubs.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeAlias

from busflow.launchfile.model.description import Compression

Part: TypeAlias = bytes | memoryview
Compressor: TypeAlias = Callable[[Sequence[Part], int], Sequence[Part]]
"""What makes fewer bytes of the parts of a chunk, whose size in all it is told."""

MCAP_WORDS = {Compression.NONE: "", Compression.LZ4: "lz4", Compression.ZSTD: "zstd"}
"""What MCAP calls each."""

_ZSTD_LEVEL = 1
"""The readings of sensors get hardly smaller at higher levels, which take twice the time."""


def compressor(compression: Compression) -> Compressor:
    """A compressor for chunks that are written one after the other; large parts are not copied on the way."""
    return {Compression.NONE: _as_it_is, Compression.LZ4: _lz4, Compression.ZSTD: _zstd}[compression]()


def _as_it_is() -> Compressor:
    return lambda parts, _size: parts


def _zstd() -> Compressor:
    import zstandard

    context = zstandard.ZstdCompressor(level=_ZSTD_LEVEL)

    def compress(parts: Sequence[Part], size: int) -> Sequence[Part]:
        if len(parts) == 1:
            return [context.compress(parts[0])]
        stream: Any = context.compressobj(size=size)
        return [*map(stream.compress, parts), stream.flush()]

    return compress


def _lz4() -> Compressor:
    import lz4.frame  # pyright: ignore[reportMissingTypeStubs]  # it has none

    def compress(parts: Sequence[Part], size: int) -> Sequence[Part]:
        stream: Any = lz4.frame.LZ4FrameCompressor()
        return [stream.begin(size), *map(stream.compress, parts), stream.flush()]

    return compress
