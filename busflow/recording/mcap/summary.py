"""The summary at the end of an MCAP file: what it holds and where, without reading the rest."""

from __future__ import annotations

import zlib
from collections.abc import Collection
from dataclasses import dataclass, field
from typing import NamedTuple

from mcap import records
from mcap.records import McapRecord

from busflow.errors import BagError
from busflow.recording.mcap.bounds import MOST_SUMMARY
from busflow.recording.mcap.records import FRAME, MAGIC, RecordFile, parse

_FOOTER = FRAME.size + 20 + len(MAGIC)
_CRC = 4


class ChunkPlace(NamedTuple):
    """The place and contents of a chunk, as the summary states them."""

    start: int
    end: int
    """The end of its message indices."""
    first_ns: int
    last_ns: int
    channels: frozenset[int]
    """The channels of its messages; empty where they are not stated."""

    def may_hold(self, channels: Collection[int], since_ns: int, until_ns: int) -> bool:
        """Return whether it may hold a message of these channels and this time."""
        in_time = self.first_ns <= until_ns and self.last_ns >= since_ns
        return in_time and not (self.channels and self.channels.isdisjoint(channels))


@dataclass(slots=True)
class Summary:
    """The contents of a file's summary section."""

    start: int
    """The offset of the summary; 0 if the file has a footer and no summary."""
    schemas: dict[int, records.Schema] = field(default_factory=dict[int, records.Schema])
    channels: dict[int, records.Channel] = field(default_factory=dict[int, records.Channel])
    statistics: records.Statistics | None = None
    chunks: list[ChunkPlace] = field(default_factory=list[ChunkPlace])
    indices: dict[int, tuple[tuple[int, int], tuple[int, int]]] = field(
        default_factory=dict[int, tuple[tuple[int, int], tuple[int, int]]]
    )
    """For each channel the times of its first and last chunk, and the offsets of its message indices there."""
    attachments: list[records.AttachmentIndex] = field(default_factory=list[records.AttachmentIndex])
    metadata: list[records.MetadataIndex] = field(default_factory=list[records.MetadataIndex])

    @property
    def whole(self) -> bool:
        """True if it has every channel, so that messages can be found without reading those before."""
        counted = self.statistics
        if counted is None or counted.channel_count != len(self.channels):
            return False
        return {channel.schema_id for channel in self.channels.values()} - {0} <= self.schemas.keys()


def summary_of(file: RecordFile) -> Summary:
    """Return the summary of a file, checked against its CRC.

    Raises:
        BagError: There is none, since the file was not finished, or it is damaged.
    """
    footer = _footer(file)
    end = file.size - _FOOTER
    start = footer.summary_start
    if not start:
        return Summary(0)
    if not len(MAGIC) <= start <= end or end - start > MOST_SUMMARY:
        raise file.damaged(f"the footer says that the summary begins at {start}", end)
    summary = Summary(start)
    crc = 0
    file.go_to(start)
    while file.at < end:
        frame = file.next()
        if frame.end > end:
            raise file.damaged("a record of the summary goes beyond its end", frame.offset)
        body = file.body(frame)
        crc = zlib.crc32(body, zlib.crc32(FRAME.pack(frame.opcode, frame.length), crc))
        _take(summary, parse(frame.opcode, body, file.name, frame.offset))
    # The CRC is also of the footer up to where the CRC stands itself.
    crc = zlib.crc32(file.tail(_FOOTER)[: FRAME.size + 20 - _CRC], crc)
    if footer.summary_crc not in (0, crc):
        raise file.damaged("the summary is not what its CRC stands for", start)
    return summary


def _footer(file: RecordFile) -> records.Footer:
    tail = file.tail(_FOOTER)
    if len(tail) < _FOOTER or not tail.endswith(MAGIC):
        raise BagError("it ends without a footer: it is still being recorded, or was cut off", file=file.name)
    opcode, length = FRAME.unpack_from(tail)
    offset = file.size - _FOOTER
    footer = parse(opcode, tail[FRAME.size : -len(MAGIC)], file.name, offset)
    if length != _FOOTER - FRAME.size - len(MAGIC) or not isinstance(footer, records.Footer):
        raise file.damaged("there is no footer where it belongs", offset)
    return footer


def _take(summary: Summary, record: McapRecord | None) -> None:
    match record:
        case records.Schema():
            summary.schemas[record.id] = record
        case records.Channel():
            summary.channels[record.id] = record
        case records.Statistics():
            summary.statistics = record
        case records.ChunkIndex():
            start = record.chunk_start_offset
            end = start + record.chunk_length + record.message_index_length
            times = record.message_start_time, record.message_end_time
            summary.chunks.append(ChunkPlace(start, end, *times, frozenset(record.message_index_offsets)))
            for channel, place in record.message_index_offsets.items():
                begins, ends = (record.message_start_time, place), (record.message_end_time, place)
                first, last = summary.indices.get(channel, (begins, ends))
                summary.indices[channel] = min(first, begins), max(last, ends)
        case records.AttachmentIndex():
            summary.attachments.append(record)
        case records.MetadataIndex():
            summary.metadata.append(record)
        case _:
            pass
