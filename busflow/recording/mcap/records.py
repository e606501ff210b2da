"""MCAP's records: where one begins and ends in a file, and what is in it, refused before it is allocated or believed.

The package `mcap` parses the content of a record. It reads cut-off text as short text, and allocates what a file claims
to hold. So this module frames the records itself, and passes on only bytes that are there. Messages, of which there are
millions, are not parsed by the package at all.
"""

from __future__ import annotations

import os
import shlex
import stat
import zlib
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path
from struct import Struct
from typing import BinaryIO, NamedTuple, Self

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import McapRecord

from busflow.errors import BagError
from busflow.recording.mcap.bounds import LARGEST_DETAIL, LARGEST_INDEX, LARGEST_RECORD

MAGIC = b"\x89MCAP0\r\n"
FRAME = Struct("<BQ")
"""The frame of a record: its opcode and its length in bytes."""
MESSAGE = Struct("<HIQQ")
"""The head of a message: its channel, sequence, log time and publish time."""

_MOST: dict[int, int] = {
    **dict.fromkeys((Opcode.CHUNK, Opcode.MESSAGE, Opcode.ATTACHMENT), LARGEST_RECORD),
    Opcode.MESSAGE_INDEX: LARGEST_INDEX,
}
_PRIVATE = 0x80
"""The first opcode that MCAP leaves to private use."""
_PARSERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.HEADER: records.Header.read,
    Opcode.FOOTER: records.Footer.read,
    Opcode.SCHEMA: records.Schema.read,
    Opcode.CHANNEL: records.Channel.read,
    Opcode.ATTACHMENT: records.Attachment.read,
    Opcode.METADATA: records.Metadata.read,
    Opcode.DATA_END: records.DataEnd.read,
    Opcode.MESSAGE_INDEX: records.MessageIndex.read,
    Opcode.CHUNK_INDEX: records.ChunkIndex.read,
    Opcode.ATTACHMENT_INDEX: records.AttachmentIndex.read,
    Opcode.METADATA_INDEX: records.MetadataIndex.read,
    Opcode.STATISTICS: records.Statistics.read,
    Opcode.SUMMARY_OFFSET: records.SummaryOffset.read,
}


class Frame(NamedTuple):
    """A record that is yet to be read: its kind, where it begins, and how many bytes follow its frame."""

    opcode: int
    offset: int
    length: int

    @property
    def end(self) -> int:
        """The offset of the next record."""
        return self.offset + FRAME.size + self.length


class RecordFile:
    """A file of records, read from front to back or from where it is put; it never waits and never reads beyond."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            BagError: It is no MCAP, or cannot be opened.
        """
        self.name: str = str(path)
        self._file = _opened(path)
        self.size: int = os.fstat(self._file.fileno()).st_size
        self.at: int = 0
        self.crc: int | None = 0
        """The CRC of everything read from the beginning; None once something was passed over."""
        start = self._read(min(self.size, len(MAGIC)))
        if start != MAGIC:
            self.close()
            raise _no_mcap(self.name, start, self.size)

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def go_to(self, offset: int) -> None:
        """Continue at an offset."""
        if offset != self.at:
            self._file.seek(offset)
            self.at, self.crc = offset, None

    def restart(self) -> None:
        """Continue at the first record, and compute the CRC of the whole again."""
        self._file.seek(0)
        self.at, self.crc = 0, 0
        self._read(len(MAGIC))

    def next(self) -> Frame:
        """Return the frame of the next record.

        Raises:
            BagError: The file ends, or what follows cannot be a record.
        """
        offset = self.at
        left = self.size - offset
        if left < FRAME.size:
            raise self.damaged("the file ends without its footer" if left <= 0 else "a record is cut off", offset)
        opcode, length = FRAME.unpack(self._read(FRAME.size))
        if opcode == 0:
            raise self.damaged("there is no record with the opcode 0", offset)
        name = named(opcode)
        if length > left - FRAME.size:
            there = f"{left - FRAME.size} of the {length} bytes of {name}"
            raise self.damaged(f"{there} are there: the file was cut off, or this length is wrong", offset)
        most = _MOST.get(opcode, LARGEST_DETAIL if opcode < _PRIVATE else LARGEST_RECORD)
        if length > most:
            raise self.damaged(f"{name} of {length} bytes is more than the {most} that are read", offset)
        return Frame(opcode, offset, length)

    def body(self, frame: Frame) -> bytes:
        """Return the contents of the record whose frame was just read."""
        return self._read(frame.length)

    def record(self, frame: Frame) -> McapRecord | None:
        """Return the record whose frame was just read; None for an unknown opcode.

        Raises:
            BagError: It is damaged.
        """
        return parse(frame.opcode, self.body(frame), self.name, frame.offset)

    def check_data(self, end: records.DataEnd, crc: int | None, offset: int) -> None:
        """Check the CRC that the end of the data states, if that of all data before it is known.

        Raises:
            BagError: They differ.
        """
        if end.data_section_crc and crc not in (None, end.data_section_crc):
            raise self.damaged("what lies before it is not what its CRC stands for", offset)

    def peek(self, frame: Frame, size: int) -> bytes:
        """Return the first bytes of the record whose frame was just read, which is still to be read."""
        found = self._file.read(min(size, frame.length))
        self._file.seek(self.at)
        return found

    def pass_over(self, frame: Frame) -> None:
        """Skip the record whose frame was just read; the CRC of the whole is then unknown."""
        self.go_to(frame.end)

    def tail(self, count: int) -> bytes:
        """Return the last bytes of the file."""
        at = self.at
        self._file.seek(max(0, self.size - count))
        found = self._file.read(count)
        self._file.seek(at)
        return found

    def damaged(self, reason: str, offset: int) -> BagError:
        """Return an error about this place."""
        return BagError(reason, file=self.name, offset=offset)

    def _read(self, length: int) -> bytes:
        data = self._file.read(length)
        if len(data) < length:
            raise self.damaged("the file has become shorter while it was read", self.at)
        self.at += length
        if self.crc is not None:
            self.crc = zlib.crc32(data, self.crc)
        return data


def parse(opcode: int, body: bytes | memoryview, file: str, offset: int) -> McapRecord | None:
    """Parse a record; None for an unknown opcode, which readers pass over.

    Raises:
        BagError: It is cut off, or its text is none.
    """
    parser = _PARSERS.get(opcode)
    if parser is None:
        return None
    stream = _Exactly(body)
    try:
        record = parser(stream)
    except (_Short, UnicodeDecodeError, OverflowError, MemoryError) as error:
        raise BagError(f"{named(opcode)} is damaged: {error}", file=file, offset=offset) from None
    if isinstance(record, records.Attachment):
        stated = int.from_bytes(body[stream.count - 4 : stream.count], "little")
        if stated and stated != zlib.crc32(body[: stream.count - 4]):
            raise BagError("the attachment is not what its CRC stands for", file=file, offset=offset)
    return record


def framed(data: bytes, file: str, offset: int) -> Iterator[tuple[int, int, int]]:
    """Yield the opcode, start and end of each record inside a chunk.

    Raises:
        BagError: One is cut off, or can be none.
    """
    unpack, at, size = FRAME.unpack_from, 0, len(data)
    while at < size:
        if size - at < FRAME.size:
            raise BagError("a record inside a chunk is cut off", file=file, offset=offset)
        opcode, length = unpack(data, at)
        start = at + FRAME.size
        at = start + length
        if at > size:
            reason = f"a record inside a chunk announces {length} bytes, and {size - start} are left"
            raise BagError(reason, file=file, offset=offset)
        if opcode == 0:
            raise BagError("there is no record with the opcode 0", file=file, offset=offset)
        yield opcode, start, at


def named(opcode: int) -> str:
    """Return the kind of a record in words.

    >>> named(6), named(7), named(200)
    ('a chunk', 'a message index', 'a record of kind 200')
    """
    try:
        word = Opcode(opcode).name.lower().replace("_", " ")
    except ValueError:
        return f"a record of kind {opcode}"
    return f"{'an' if word[0] == 'a' else 'a'} {word}"


class _Short(Exception):
    """A record ends before what it announces."""


class _Exactly(ReadDataStream):
    """Reads a record's bytes; raises where fewer are left than are asked for."""

    def __init__(self, body: bytes | memoryview) -> None:
        super().__init__(BytesIO(body))
        self._left = len(body)

    def read(self, length: int) -> bytes:
        self._left -= length
        if self._left < 0:
            raise _Short(f"it announces {length} bytes where {self._left + length} are left")
        return super().read(length)


def _opened(path: Path) -> BinaryIO:
    """Return the file, opened without waiting: a pipe or a device may never answer."""
    try:
        if stat.S_ISREG(path.stat().st_mode):
            return path.open("rb", buffering=1 << 16)
    except OSError as error:
        raise BagError(f"it cannot be opened: {error.strerror or error}", file=str(path)) from None
    except ValueError as error:  # a NUL in the name
        raise BagError(f"it cannot be opened: {error}", file=str(path)) from None
    raise BagError("it is not a file", file=str(path), fix="name an .mcap file, or the directory of a bag")


def _no_mcap(name: str, start: bytes, size: int) -> BagError:
    if not size:
        return BagError("the file is empty", file=name, fix="nothing was recorded, or nothing reached the disk")
    if start.startswith(b"#ROSBAG"):
        fix = "rosbags-convert, from the package rosbags, makes a bag of ROS 2 of it"
        return BagError("it is a bag of ROS 1", file=name, fix=fix)
    if start == b"SQLite f":
        fix = "name the directory that it lies in, which has a metadata.yaml"
        return BagError("it is a database of rosbag2", file=name, fix=fix)
    if start.startswith(b"\x28\xb5\x2f\xfd"):  # zstd's number
        fix = f"zstd -d {shlex.quote(name)} unpacks it; the directory of a bag is read as it is"
        return BagError("it is compressed with zstd as a whole", file=name, fix=fix)
    what = "the file ends within its first eight bytes" if MAGIC.startswith(start) else "it is no MCAP"
    return BagError(f"{what}: it begins with {start.hex(' ')}", file=name, offset=0)
