"""`McapWriter`: an MCAP file as it is written: chunks that are cut by size, an index of each, and a summary at the end.

Message records are built here, because they are most of a recording's cost; the package `mcap` builds the rarer ones.
The same messages give the same bytes. This module reads no clock: its caller decides when a chunk that is not full goes
to the file. Nothing in memory grows with the number of messages: the index of the chunks waits on the disk.
"""

# The libraries that compress have no stubs.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import sys
import zlib
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from struct import Struct
from tempfile import SpooledTemporaryFile
from typing import Any, Protocol, TypeAlias

from mcap.data_stream import ReadDataStream, RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)

from busflow.launchfile.model.description import Compression
from busflow.recording.mcap.bounds import MOST_SUMMARY
from busflow.recording.mcap.records import FRAME, MAGIC

Part: TypeAlias = bytes | memoryview
Payload: TypeAlias = bytes | list[Part]
"""A message's bytes, or what they are when joined."""

PROFILE = "ros2"
CHUNK_BYTES = 128 * 1024
"""A reader that seeks has to read the whole of a chunk; with much smaller ones, compression finds less to shorten."""
LARGE = 32 * 1024
"""Parts of messages from this size on are neither copied nor joined with others."""

_INDEX_BYTES = 1 << 20
"""Up to this size the index of the chunks waits in memory: a short recording makes no file for it."""
_BLOCK_BYTES = 1 << 16
_OFFSETS_BYTES = 6 * (FRAME.size + 17)
"""The size of the summary's own table of contents."""

_MESSAGE = Struct("<BQHIQQ")
_MESSAGE_HEAD = 22
_CHUNK = Struct("<BQQQQII")
_CHUNK_HEAD = 40
_LENGTH = Struct("<Q")
_INDEX = Struct("<BQHI")
_INDEX_ENTRY = 16
_SEQUENCES = (1 << 32) - 1
"""MCAP gives the number of a message 32 bits; after so many it begins anew."""


class Written(Protocol):
    """The file that is written."""

    def write(self, data: memoryview, /) -> int:
        """Write some of it, and return how many bytes."""
        ...


class McapWriter:
    """An MCAP file that is being written; it is readable up to the last chunk whenever the writing ends."""

    def __init__(
        self,
        file: Written,
        *,
        library: str,
        compression: Compression = Compression.ZSTD,
        chunk_bytes: int = CHUNK_BYTES,
        folder: Path | None = None,
        most_summary: int = MOST_SUMMARY,
    ) -> None:
        """Begin a file.

        Args:
            file: the file to write, empty so far; unbuffered, so that nothing waits in this process.
            library: the name of the writing program in the file.
            compression: of the chunks.
            chunk_bytes: at which size a chunk is full, before it is compressed.
            folder: where the index of a long recording waits, in a file without a name; by default the system's own.
            most_summary: bytes of the summary, beyond which it leaves out the index of the chunks: readers refuse it.
        """
        self._file, self._compression, self._chunk_bytes = file, compression, chunk_bytes
        self._compress = compressor(compression)
        self.size: int = 0
        """Bytes of whole records that were handed to the file."""
        self.written: int = 0
        """The number of messages in the file."""
        self._cuts = 0
        """The number of chunks in the file."""
        self._check = 0
        """The CRC-32 of all that was written, by which a reader sees flipped bits outside the chunks too."""
        self._chunk = _Chunk()
        self._schemas: list[McapRecord] = []
        self._channels: list[McapRecord] = []
        self._index = SpooledTemporaryFile(_INDEX_BYTES, dir=folder and str(folder))  # noqa: SIM115  # it lives as long as the writer
        """A `ChunkIndex` record for each chunk that was handed to the file."""
        self._most_summary = most_summary
        self._attachments: list[McapRecord] = []
        self._metadata: list[McapRecord] = []
        self._counts: dict[int, int] = {}
        self._first: int | None = None
        self._last = 0
        self._write([MAGIC, _record(Header(PROFILE, library))])

    @property
    def messages(self) -> int:
        """The number of messages that were added."""
        return sum(self._counts.values())

    @property
    def open_chunk(self) -> bool:
        """True if messages wait in a chunk that is not in the file yet."""
        return self._chunk.count > 0

    @property
    def open_since(self) -> int:
        """The time of the first message in the chunk that is not in the file yet."""
        return self._chunk.first

    def add_schema(self, schema_id: int, name: str, encoding: str, data: bytes) -> None:
        """Describe a type; ids are given by the caller, and begin at 1."""
        schema = Schema(id=schema_id, data=data, encoding=encoding, name=name)
        self._schemas.append(schema)
        self._chunk.add_record(_record(schema))

    def add_channel(
        self, channel_id: int, topic: str, encoding: str, schema_id: int, metadata: Mapping[str, str]
    ) -> None:
        """Announce a topic, of a schema that is described; ids are given by the caller, and begin at 1."""
        channel = Channel(
            id=channel_id, topic=topic, message_encoding=encoding, metadata=dict(metadata), schema_id=schema_id
        )
        self._channels.append(channel)
        self._counts[channel_id] = 0
        self._chunk.add_record(_record(channel))

    def add_message(
        self, channel_id: int, sequence: int, time_ns: int, payload: Payload, *, published_ns: int | None = None
    ) -> None:
        """Write a message of a channel that is announced; it was published at its time unless that is said."""
        self._counts[channel_id] += 1
        if self._first is None or time_ns < self._first:
            self._first = time_ns
        if time_ns > self._last:
            self._last = time_ns
        self._chunk.add_message(
            channel_id, sequence, time_ns, payload, time_ns if published_ns is None else published_ns
        )
        if self._chunk.size >= self._chunk_bytes:
            self.cut()

    def add_metadata(self, name: str, metadata: Mapping[str, str]) -> None:
        """Write a metadata record."""
        self.cut()
        record = _record(Metadata(name=name, metadata=dict(metadata)))
        self._metadata.append(MetadataIndex(offset=self.size, length=len(record), name=name))
        self._write([record])

    def add_attachment(self, name: str, media_type: str, data: bytes, *, time_ns: int) -> None:
        """Write a file into the file."""
        self.cut()
        record = _record(Attachment(create_time=time_ns, log_time=time_ns, name=name, media_type=media_type, data=data))
        self._attachments.append(
            AttachmentIndex(
                offset=self.size,
                length=len(record),
                log_time=time_ns,
                create_time=time_ns,
                data_size=len(data),
                name=name,
                media_type=media_type,
            )
        )
        self._write([record])

    def cut(self) -> None:
        """Write what waits to the file, so that it survives this process, though not a loss of power."""
        chunk, self._chunk = self._chunk, _Chunk()
        if not chunk.count:
            self._write(chunk.joined())  # what describes types and topics may stand outside a chunk
            return
        parts = chunk.joined()
        check = 0
        for part in parts:
            check = zlib.crc32(part, check)
        packed = self._compress(parts, chunk.size)
        size, word = sum(map(len, packed)), MCAP_WORDS[self._compression].encode()
        length = _CHUNK_HEAD + len(word) + size
        head = _CHUNK.pack(Opcode.CHUNK, length, chunk.first, chunk.last, chunk.size, check, len(word))
        start, index_start = self.size, self.size + FRAME.size + length
        indexes, offsets = chunk.indexes(index_start)
        self._write([head, word, _LENGTH.pack(size), *packed, *indexes])
        self.written += chunk.count
        self._cuts += 1
        index = ChunkIndex(
            chunk_length=FRAME.size + length,
            chunk_start_offset=start,
            compression=word.decode(),
            compressed_size=size,
            message_end_time=chunk.last,
            message_index_length=self.size - index_start,
            message_index_offsets=offsets,
            message_start_time=chunk.first,
            uncompressed_size=chunk.size,
        )
        self._index.write(_record(index))

    def finish(self) -> None:
        """Write the summary, by which readers find their way; nothing may be added after it."""
        self.cut()
        self._write(self._end())

    def cut_off(self, size: int) -> None:
        """Count only the messages in the first bytes of the file; nothing may be added after it."""
        if size < self.size:
            written, self.written = self.written, 0  # which it stays if the disk gives the index back no more
            with suppress(OSError):
                self.written = written - sum(_count(each) for each in self._indexes() if _end(each) > size)

    def close(self) -> None:
        """Give up the place where the index waits; nothing may be called after it."""
        with suppress(OSError):  # a full disk: the writer has said so already
            self._index.close()

    def _end(self) -> Iterator[Part]:
        """Yield the records from the end of the data on; the index comes in blocks, as it lies on the disk."""
        end = _record(DataEnd(self._check))
        yield end
        start = at = self.size + len(end)
        check, offsets = 0, b""
        for opcode, parts in self._groups():
            begin = at
            for part in parts:
                check = zlib.crc32(part, check)
                at += len(part)
                yield part
            offsets += _record(SummaryOffset(group_opcode=opcode, group_start=begin, group_length=at - begin))
        yield offsets
        footer = Footer(summary_start=start, summary_offset_start=at, summary_crc=0)
        footer.summary_crc = zlib.crc32(_record(footer)[:-4], zlib.crc32(offsets, check))
        yield _record(footer)
        yield MAGIC

    def _groups(self) -> Iterator[tuple[Opcode, Iterable[bytes]]]:
        """Yield the groups of the summary's records."""
        before: list[tuple[Opcode, Sequence[McapRecord]]] = [
            (Opcode.SCHEMA, self._schemas),
            (Opcode.CHANNEL, self._channels),
            (Opcode.STATISTICS, [self._statistics()]),
        ]
        after = [(Opcode.ATTACHMENT_INDEX, self._attachments), (Opcode.METADATA_INDEX, self._metadata)]
        rest = sum(len(_record(each)) for _, group in (*before, *after) for each in group)
        for opcode, group in before:
            yield opcode, map(_record, group)
        fits = rest + self._index.tell() <= self._most_summary - _OFFSETS_BYTES
        yield Opcode.CHUNK_INDEX, self._index_blocks() if fits else ()
        for opcode, group in after:
            yield opcode, map(_record, group)

    def _index_blocks(self) -> Iterator[bytes]:
        self._index.seek(0)
        while block := self._index.read(_BLOCK_BYTES):
            yield block

    def _indexes(self) -> Iterator[ChunkIndex]:
        """Yield the index of each chunk that was handed to the file."""
        self._index.seek(0)
        while frame := self._index.read(FRAME.size):
            yield ChunkIndex.read(ReadDataStream(BytesIO(self._index.read(FRAME.unpack(frame)[1]))))

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self._channels),
            channel_message_counts={channel: count for channel, count in self._counts.items() if count},
            chunk_count=self._cuts,
            message_count=self.messages,
            metadata_count=len(self._metadata),
            message_start_time=self._first or 0,
            message_end_time=self._last,
            schema_count=len(self._schemas),
        )

    def _write(self, parts: Iterable[Part]) -> None:
        size = 0
        for part in _joined(parts):
            left = memoryview(part)
            size += len(left)
            self._check = zlib.crc32(left, self._check)
            while left:
                left = left[self._file.write(left) :]
        self.size += size


class _Chunk:
    """The records of a chunk, and where in it each channel's messages are."""

    def __init__(self) -> None:
        self.size = self.count = self.first = self.last = 0
        self._parts: list[Part] = []
        self._index: dict[int, array[int]] = {}

    def add_record(self, record: bytes) -> None:
        self._parts.append(record)
        self.size += len(record)

    def add_message(self, channel_id: int, sequence: int, time_ns: int, payload: Payload, published_ns: int) -> None:
        size = size_of(payload)
        index = self._index.get(channel_id)
        if index is None:
            index = self._index[channel_id] = array("Q")
        index.extend((time_ns, self.size))
        if not self.count or time_ns < self.first:
            self.first = time_ns
        if time_ns > self.last:
            self.last = time_ns
        self.count += 1
        length = _MESSAGE_HEAD + size
        number = (sequence - 1) % _SEQUENCES + 1 if sequence else 0  # which it stays: it means that there is none
        head = _MESSAGE.pack(Opcode.MESSAGE, length, channel_id, number, time_ns, published_ns)
        self._parts.append(head)
        if isinstance(payload, bytes):
            self._parts.append(payload)
        else:
            self._parts.extend(payload)
        self.size += FRAME.size + length

    def joined(self) -> list[Part]:
        """Return the records, all small parts between two large ones joined."""
        return list(_joined(self._parts))

    def indexes(self, start: int) -> tuple[list[Part], dict[int, int]]:
        """Return the index of each channel, the first one at this offset of the file, and where each is."""
        parts: list[Part] = []
        offsets: dict[int, int] = {}
        for channel_id, index in self._index.items():
            if sys.byteorder != "little":
                index.byteswap()
            entries = index.tobytes()
            offsets[channel_id] = start
            head = _INDEX.pack(Opcode.MESSAGE_INDEX, 6 + len(entries), channel_id, len(entries))
            parts += (head, entries)
            start += len(head) + len(entries)
        return parts, offsets


def size_of(payload: Payload) -> int:
    """Return the bytes of a message."""
    return len(payload) if isinstance(payload, bytes) else sum(map(len, payload))


def _joined(parts: Iterable[Part]) -> Iterator[Part]:
    small: list[Part] = []
    for part in parts:
        if len(part) < LARGE:
            small.append(part)
            continue
        if small:
            yield b"".join(small)
            small.clear()
        yield part
    if small:
        yield b"".join(small)


def _record(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _count(index: ChunkIndex) -> int:
    """Return the number of messages of a chunk: each has an entry in the index of its channel."""
    return (index.message_index_length - _INDEX.size * len(index.message_index_offsets)) // _INDEX_ENTRY


def _end(index: ChunkIndex) -> int:
    """Return where in the file a chunk ends."""
    return index.chunk_start_offset + index.chunk_length


Compressor: TypeAlias = Callable[[Sequence[Part], int], Sequence[Part]]
"""A function that packs the parts of a chunk; it receives their total size."""

MCAP_WORDS = {Compression.NONE: "", Compression.LZ4: "lz4", Compression.ZSTD: "zstd"}
"""MCAP's name of each compression."""

_ZSTD_LEVEL = 1
"""The readings of sensors get hardly smaller at higher levels, which take twice the time."""


def compressor(compression: Compression) -> Compressor:
    """Return a compressor for chunks that are written one after the other; large parts are not copied on the way."""
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
