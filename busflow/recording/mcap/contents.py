"""`Contents`: every record of an MCAP file in its place, for tools that check the file itself.

It can continue behind a damaged stretch, if the summary states where the next chunk begins.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple, Self

from mcap import records
from mcap.opcode import Opcode
from mcap.records import McapRecord

from busflow.errors import BagError
from busflow.recording.mcap.chunks import Chunk, chunk_of, unpacked
from busflow.recording.mcap.records import FRAME, MAGIC, MESSAGE, Frame, RecordFile, framed, parse
from busflow.recording.mcap.summary import Summary, summary_of


class Found(NamedTuple):
    """A record, and where it is."""

    record: McapRecord | Chunk
    """A chunk is followed by what is in it."""
    offset: int
    within: int | None = None
    """The offset inside the chunk that begins at `offset`."""


class Contents:
    """A file that is read record by record."""

    def __init__(self, path: Path) -> None:
        """Open a file.

        Raises:
            BagError: It is no MCAP.
        """
        self._file = RecordFile(path)
        self.name: str = self._file.name
        self.size: int = self._file.size
        self.summary: Summary | None = None
        self.unfinished: BagError | None = None
        """The reason why there is no reliable summary."""
        try:
            self.summary = summary_of(self._file)
        except BagError as error:
            self.unfinished = error
        self._file.restart()
        self._ended = self._data_ended = False
        self.damages: list[BagError] = []
        """The damages that `beyond_damage` passed over or ended at."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def __iter__(self) -> Iterator[Found]:
        """Yield every record, to the footer.

        Raises:
            BagError: The file is damaged here, or ends here without a footer.
        """
        while not self._ended:
            crc = self._file.crc
            yield from self._in(self._file.next(), crc)

    def beyond_damage(self) -> Iterator[Found]:
        """Yield every readable record; damaged ones are left out and listed in `damages`."""
        file = self._file
        while not self._ended:
            start, crc, frame = file.at, file.crc, None
            try:
                frame = file.next()
                yield from self._in(frame, crc)
            except BagError as error:
                self.damages.append(error)
                if frame is not None and file.at == frame.end:
                    continue  # the record is there, and what is in it is damaged
                if not self._next_chunk(start):
                    return

    def _next_chunk(self, offset: int) -> bool:
        """Go on at the first chunk behind a place of which the summary knows."""
        starts = [each.start for each in (self.summary.chunks if self.summary else [])]
        behind = [start for start in starts if offset < start < self.size]
        if behind:
            self._file.go_to(min(behind))
        return bool(behind)

    def _in(self, frame: Frame, crc: int | None) -> Iterator[Found]:
        """Yield the record that begins here, and all records in it if it is a chunk; `crc` is that of all before it."""
        body, offset = self._file.body(frame), frame.offset
        if frame.opcode == Opcode.CHUNK:
            data = unpacked(body, self.name, offset)
            yield Found(chunk_of(body, self.name, offset), offset)
            for opcode, start, end in framed(data, self.name, offset):
                record = self._record(opcode, data[start:end], offset)
                if record is not None:
                    yield Found(record, offset, start - FRAME.size)
            return
        record = self._record(frame.opcode, body, offset)
        if record is not None:
            yield Found(record, offset)
        if isinstance(record, records.DataEnd):
            self._data_ended = True
            self._file.check_data(record, crc, offset)
        elif isinstance(record, records.Footer):
            self._ended = True
            if not self._data_ended:
                raise self._file.damaged("there is no record that says where the messages end", offset)
            self._end()

    def _record(self, opcode: int, body: bytes, offset: int) -> McapRecord | None:
        if opcode != Opcode.MESSAGE:
            return parse(opcode, body, self.name, offset)
        if len(body) < MESSAGE.size:
            raise self._file.damaged("a message is cut off", offset)
        number, sequence, log_time, publish_time = MESSAGE.unpack_from(body)
        return records.Message(number, log_time, body[MESSAGE.size :], publish_time, sequence)

    def _end(self) -> None:
        file = self._file
        if file.tail(len(MAGIC)) != MAGIC or file.at + len(MAGIC) != file.size:
            raise file.damaged("the footer is not the end of the file", file.at)
