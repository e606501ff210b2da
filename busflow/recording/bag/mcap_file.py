"""`McapFile`: one MCAP file of a bag, from its beginning to its end or to where it is damaged.

The records are read one after another: a file whose writer was killed has no summary, and one that is being written
grows. A summary states the same facts sooner, and lets a reader skip chunks that it does not need.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import cast

from mcap import records
from mcap.opcode import Opcode
from mcap.records import McapRecord

from busflow.errors import BagError
from busflow.recording.bag.bag_file import SINCE, UNTIL, Survey
from busflow.recording.bag.channel import Channel, Entry
from busflow.recording.bag.facts import FACTS, LAUNCH_FILE, LEDGER, PART, later_publishers
from busflow.recording.mcap.bounds import MOST_DECLARED
from busflow.recording.mcap.chunks import TIMES, unpacked
from busflow.recording.mcap.records import FRAME, MAGIC, MESSAGE, Frame, RecordFile, framed, named, parse
from busflow.recording.mcap.summary import Summary, summary_of

_KEPT = {FACTS, LEDGER, PART}
"""The metadata that is kept."""
_MOST_DETAILS = 64
"""Limit of the metadata and attachments that are read when a file is opened."""
_INDEX_HEAD, _INDEX_ENTRY = 6, 16
"""Bytes of a message index before its entries, and of each of them."""
_MOST_PUBLISHERS = 100
"""The most nodes that are named with a channel."""
_OF_THE_END = {Opcode.FOOTER, Opcode.STATISTICS, Opcode.SUMMARY_OFFSET, Opcode.CHUNK_INDEX}
_DATA = {Opcode.CHUNK, Opcode.MESSAGE}


class McapFile:
    """A file of a bag; `summary` is None where it has none, and then `unfinished` says why."""

    def __init__(self, path: Path) -> None:
        """Open a file, and read its first records and its summary.

        Raises:
            BagError: It is no MCAP.
        """
        self.path = path
        self.summary: Summary | None = None
        self.unfinished: BagError | None = None
        self.metadata: dict[str, dict[str, str]] = {}
        """The metadata found so far, by name."""
        self.launch_file: str | None = None
        self._channels: dict[tuple[object, ...], Channel] = {}
        with RecordFile(path) as file:
            self.size: int = file.size
            header = file.record(file.next())
            if not isinstance(header, records.Header):
                raise file.damaged("it does not begin with a header", len(MAGIC))
            self.header = header
            try:
                self.summary = summary_of(file)
                self._find_details(file, self.summary)
            except BagError as error:
                self.unfinished = error
                self._read_beginning(file)

    def overview(self) -> Survey | None:
        """Return the contents by the summary; None if it is incomplete."""
        summary = self.summary
        if summary is None or summary.statistics is None or not summary.whole:
            return None
        counted = summary.statistics
        counts: Counter[Channel] = Counter()
        for number, channel in summary.channels.items():
            found = self.channel(channel, summary.schemas.get(channel.schema_id))
            counts[found] += counted.channel_message_counts.get(number, 0)
        if not counted.message_count:
            return Survey(counts, None, None)
        return Survey(counts, counted.message_start_time, counted.message_end_time)

    def spans(self) -> Mapping[Channel, tuple[int, int]] | None:
        """Return the times of each channel's first and last message, by the indices of chunks; None without them."""
        overview, summary = self.overview(), self.summary
        if overview is None or summary is None:
            return None
        found: dict[Channel, tuple[int, int]] = {}
        try:
            with RecordFile(self.path) as file:
                for number, channel in summary.channels.items():
                    (_, first), (_, last) = summary.indices.get(number, ((0, 0), (0, 0)))
                    times = [time for place in {first, last} - {0} for time in self._indexed(file, place)]
                    if times:
                        known = self.channel(channel, summary.schemas.get(channel.schema_id))
                        times += found.get(known, ())
                        found[known] = min(times), max(times)
        except BagError:
            return None  # reading the messages reports the damage
        return found if all(each in found for each, count in overview.counts.items() if count) else None

    @staticmethod
    def _indexed(file: RecordFile, place: int) -> list[int]:
        """Return the times of a channel's messages in a chunk, from the index at this place of the file."""
        if not len(MAGIC) <= place < file.size:
            raise file.damaged(f"the summary says that an index begins at {place}", place)
        file.go_to(place)
        record = file.record(file.next())
        return [time for time, _ in record.records] if isinstance(record, records.MessageIndex) else []

    def walk(
        self,
        wanted: Callable[[Channel], bool] = lambda _: True,
        since_ns: int = SINCE,
        until_ns: int = UNTIL,
    ) -> Iterator[Entry | McapRecord]:
        """Yield the messages that are wanted, and all other records, in the order of the file.

        Chunks are skipped if the summary lists all channels and they hold nothing of this time; otherwise everything
        is checked against its CRC.

        Raises:
            BagError: The file is damaged here, or ends here without having been finished.
        """
        with RecordFile(self.path) as file:
            yield from _Walk(self, file, wanted, since_ns, until_ns).items()

    @property
    def recorder(self) -> str:
        """The program that wrote it, and what it says of the contents."""
        library, profile = self.header.library, self.header.profile
        return f"{library}, profile {profile}" if profile else library

    @property
    def channels(self) -> Collection[Channel]:
        """The channels read so far."""
        return self._channels.values()

    def channel(self, channel: records.Channel, schema: records.Schema | None) -> Channel:
        """Return the channel that two records describe; the same one for the same records."""
        metadata = channel.metadata
        key = (
            channel.topic,
            schema.name if schema else "",
            channel.message_encoding,
            schema.data.decode(errors="replace") if schema else "",
            schema.encoding if schema else "",
            metadata.get("topic_type_hash") or None,
            metadata.get("offered_qos_profiles") or None,
        )
        known = self._channels.get(key)
        if known is None:
            stated = metadata.get("callerid", "")
            later = later_publishers(self.metadata.get(LEDGER, {})).get(channel.topic, ())
            names = (name for each in (*stated.split(","), *later) if (name := each.strip()))
            publishers = ", ".join(islice(dict.fromkeys(names), _MOST_PUBLISHERS))
            known = self._channels[key] = Channel(*key, publishers=publishers)  # pyright: ignore[reportArgumentType]  # each as its field wants it
        return known

    def take(self, record: McapRecord) -> None:
        """Keep what busflow has written beside the messages."""
        if isinstance(record, records.Metadata) and record.name in _KEPT:
            self.metadata[record.name] = record.metadata
        elif isinstance(record, records.Attachment) and record.name == LAUNCH_FILE:
            self.launch_file = record.data.decode(errors="replace")

    def _find_details(self, file: RecordFile, summary: Summary) -> None:
        """Read the metadata and the launch file at the places that the summary states."""
        places = [each.offset for each in summary.metadata if each.name in _KEPT]
        places += [each.offset for each in summary.attachments if each.name == LAUNCH_FILE]
        for offset in places[:_MOST_DETAILS]:
            if not len(MAGIC) <= offset < file.size:
                raise file.damaged(f"the summary says that something begins at {offset}", summary.start)
            file.go_to(offset)
            self._take_next(file)
        if not places:
            self._read_beginning(file)

    def _read_beginning(self, file: RecordFile) -> None:
        """Read what lies before the first message."""
        file.go_to(len(MAGIC))
        try:
            for _ in range(_MOST_DETAILS):
                if not self._take_next(file):
                    break
        except BagError:
            return  # reading the messages reports the damage

    def _take_next(self, file: RecordFile) -> bool:
        """Read a record; False where it is of the messages."""
        frame = file.next()
        if frame.opcode in _DATA or frame.opcode == Opcode.DATA_END:
            return False
        record = file.record(frame)
        if record is not None:
            self.take(record)
        return True


class _Walk:
    """One reading of a file: the channels that it has met so far, by their numbers."""

    def __init__(
        self, source: McapFile, file: RecordFile, wanted: Callable[[Channel], bool], since_ns: int, until_ns: int
    ) -> None:
        self._source, self._file, self._wanted = source, file, wanted
        self._since, self._until = since_ns, until_ns
        self._schemas: dict[int, records.Schema] = {}
        self._records: dict[int, records.Channel] = {}
        self._chosen: dict[int, Channel] = {}
        self._declared = 0
        """Bytes of schemas and channels in chunks, which may be packed small."""
        self._before = 0
        """The kind of the record before the one that is read."""
        summary = source.summary
        self._chunks = sorted(summary.chunks, reverse=True) if summary else []
        """The chunks still to be read, the next one last."""
        self._indices_end = 0
        self._indexed = bool(self._chunks)
        self._may_pass = summary is not None and summary.whole and (since_ns, until_ns) != (SINCE, UNTIL)
        if summary is not None and self._may_pass:
            for schema in summary.schemas.values():
                self._declare(schema, summary.start)
            for channel in summary.channels.values():
                self._declare(channel, summary.start)

    def items(self) -> Iterator[Entry | McapRecord]:
        """Yield the items that `McapFile.walk` yields."""
        file = self._file
        while True:
            if self._may_pass:
                self._pass_over_chunks()
            crc = file.crc
            frame = file.next()
            self._check_order(frame)
            if frame.opcode == Opcode.CHUNK:
                if self._may_pass and not self._overlaps(frame):
                    file.pass_over(frame)
                    continue
                yield from self._messages(unpacked(file.body(frame), file.name, frame.offset), frame.offset)
            elif frame.opcode == Opcode.MESSAGE:
                body = FRAME.pack(frame.opcode, frame.length) + file.body(frame)
                yield from self._messages(body, frame.offset)
            elif frame.opcode == Opcode.MESSAGE_INDEX:
                self._pass_over_index(frame)
            else:
                record = file.record(frame)
                if record is not None:
                    self._declare(record, frame.offset)
                    yield record
                if isinstance(record, records.DataEnd):
                    file.check_data(record, crc, frame.offset)
                    return

    def _pass_over_chunks(self) -> None:
        """Skip the chunks from here on that hold nothing wanted, without reading where each begins."""
        here = self._file.at
        while self._chunks and self._chunks[-1].start == here < self._chunks[-1].end:
            if self._chunks[-1].may_hold(self._chosen, self._since, self._until):
                break
            here = self._indices_end = self._chunks.pop().end
            self._before = 0
        self._file.go_to(here)

    def _check_order(self, frame: Frame) -> None:
        """Refuse a record where another kind belongs: nothing else protects a record's kind and length."""
        opcode, offset = frame.opcode, frame.offset
        if self._chunks and (offset >= self._chunks[-1].start or opcode == Opcode.DATA_END):
            place = self._chunks.pop()
            self._indices_end = place.end
            if (opcode, offset) != (Opcode.CHUNK, place.start):
                raise self._file.damaged(f"there is no chunk at byte {place.start}, where the summary says", offset)
        after_chunk = self._before in (Opcode.CHUNK, Opcode.MESSAGE_INDEX)
        if opcode == Opcode.MESSAGE_INDEX and not after_chunk:
            raise self._file.damaged("a message index follows no chunk", offset)
        if opcode == Opcode.MESSAGE and after_chunk and (not self._indexed or offset < self._indices_end):
            raise self._file.damaged("a message lies where only the index of a chunk belongs", offset)
        if opcode in _OF_THE_END:
            raise self._file.damaged(f"{named(opcode)} comes before the end of the data", offset)
        self._before = opcode

    def _pass_over_index(self, frame: Frame) -> None:
        """Skip a message index, but check it: a chunk with a damaged kind would look like one."""
        if self._may_pass:
            self._file.pass_over(frame)
            return
        body = self._file.body(frame)
        stated = int.from_bytes(body[2:_INDEX_HEAD], "little")
        if len(body) < _INDEX_HEAD or stated % _INDEX_ENTRY or stated > len(body) - _INDEX_HEAD:
            raise self._file.damaged("a message index is damaged", frame.offset)

    def _overlaps(self, frame: Frame) -> bool:
        head = self._file.peek(frame, TIMES.size)
        if len(head) < TIMES.size:
            return True
        first, last = TIMES.unpack(head)
        return first <= self._until and last >= self._since

    def _messages(self, data: bytes, offset: int) -> Iterator[Entry | McapRecord]:
        """Yield the messages of a chunk, and the schemas and channels between them."""
        chosen, damaged, since, until = self._chosen, self._file.damaged, self._since, self._until
        unpack, new_entry = MESSAGE.unpack_from, Entry._make
        for opcode, start, end in framed(data, self._file.name, offset):
            if opcode == Opcode.MESSAGE:
                if end - start < MESSAGE.size:
                    raise damaged("a message is cut off", offset)
                number, sequence, log_time, publish_time = unpack(data, start)
                channel = chosen.get(number)
                if channel is None:
                    if number not in self._records:
                        raise damaged(f"a message is of channel {number}, which is not declared before it", offset)
                elif since <= log_time <= until:
                    yield new_entry((channel, sequence, log_time, publish_time, data[start + MESSAGE.size : end]))
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._declared += end - start
                if self._declared > MOST_DECLARED:
                    raise damaged(f"topics and types take more than {MOST_DECLARED} bytes", offset)
                record = cast("McapRecord", parse(opcode, data[start:end], self._file.name, offset))
                self._declare(record, offset)
                yield record

    def _declare(self, record: McapRecord, offset: int) -> None:
        """Record a schema or a channel; a repeated declaration must be the same."""
        match record:
            case records.Schema():
                if self._schemas.setdefault(record.id, record) != record:
                    raise self._file.damaged(f"schema {record.id} is declared a second time, otherwise", offset)
            case records.Channel():
                if self._records.setdefault(record.id, record) != record:
                    raise self._file.damaged(f"channel {record.id} is declared a second time, otherwise", offset)
                if record.id in self._chosen:
                    return
                schema = self._schemas.get(record.schema_id)
                if schema is None and record.schema_id:
                    raise self._file.damaged(
                        f"channel {record.id} has schema {record.schema_id}, which is not there", offset
                    )
                channel = self._source.channel(record, schema)
                if self._wanted(channel):
                    self._chosen[record.id] = channel
            case _:
                self._source.take(record)
