"""Examination: reads all of a recording, and compares what it states with what it holds."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path

from mcap import records

from busflow.errors import BagError, MalformedMessage
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.channel import Channel
from busflow.recording.bag.completeness import shortfalls
from busflow.recording.bag.facts import RunOutcome
from busflow.recording.bag.mcap_file import McapFile
from busflow.recording.bag.series import Series
from busflow.recording.mcap.chunks import Chunk
from busflow.recording.mcap.contents import Contents, Found
from busflow.text import counted

_MOST_PER_CHANNEL = 3
"""The limit of printed findings about one channel; one fault is mostly a fault of all its messages."""
_RECORDERS_OWN = {"/parameter_events", "/rosout"}
"""Topics that the recorder writes itself, whether or not they have a publisher."""


class FindingKind(StrEnum):
    """The meaning of a finding for the recording."""

    INCOMPLETE = "incomplete"
    """Something is missing, as the recording itself says or shows."""
    WRONG = "wrong"
    """Statements and contents contradict each other, or cannot be read."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is not as it should be."""

    kind: FindingKind
    code: str
    """A stable word: damaged, unfinished, index, chunk, statistics, sequence, missed, ledger, type, message."""
    message: str
    file: str = ""
    offset: int | None = None


@dataclass(slots=True)
class Examination:
    """The scope and the findings of an examination."""

    messages: int = 0
    """The messages that were read: those before the damage, if there is any."""
    there: int = 0
    """The messages that are there: more than were read, if some lie behind the damage."""
    chunks: int = 0
    findings: list[Finding] = field(default_factory=list[Finding])

    def add(self, kind: FindingKind, code: str, message: str, file: str = "", offset: int | None = None) -> None:
        """Add a finding."""
        self.findings.append(Finding(kind, code, message, file, offset))


def examine(bag: Bag, on_message: Callable[[], None] = lambda: None) -> Examination:
    """Read all of a bag, and find what is wrong with it."""
    found = Examination()
    held = {
        file.path: _FileExamination(file.path, found, accounted=bag.ledger is not None).run()
        for file in bag.files
        if isinstance(file, McapFile)
    }
    read = _examine_messages(bag, found, on_message)
    whole = [sum(held.get(file.path, 0) for file in series.files) - sum(series.repeated[1:]) for series in bag.series]
    there = list(map(max, read, whole))
    found.there = sum(there)
    _examine_account(bag, found, there)
    return found


class _FileExamination:
    """The examination of one file's records: chunks against their times and indices, the summary against its counts."""

    def __init__(self, path: Path, found: Examination, *, accounted: bool) -> None:
        self._path, self._name, self._found, self._accounted = path, str(path), found, accounted
        self._damages = 0
        self._behind_damage = False
        """True if the next item is about a chunk that could not be read."""
        self._counts: Counter[int] = Counter()
        self._chunk: tuple[Chunk, int] | None = None
        self._index: dict[int, list[tuple[int, int]]] = {}
        """For each channel the times and offsets of its messages in the chunk."""

    def run(self) -> int:
        """Read the file, beyond damage too; return how many messages it holds."""
        with Contents(self._path) as contents:
            for found in contents.beyond_damage():
                if len(contents.damages) > self._damages:
                    self._end_chunk()
                    self._damages, self._behind_damage = len(contents.damages), True
                self._examine_record(found)
            self._end_chunk()
            unfinished = contents.unfinished
            for damage in contents.damages:
                self._report_damage(damage, cut=unfinished is not None and damage is contents.damages[-1])
            if unfinished is not None and not contents.damages:
                self._add(FindingKind.WRONG, "damaged", unfinished.reason, unfinished.offset)
        return sum(self._counts.values())

    def _report_damage(self, damage: BagError, *, cut: bool) -> None:
        kind, code = (FindingKind.INCOMPLETE, "unfinished") if cut else (FindingKind.WRONG, "damaged")
        self._add(kind, code, damage.reason, damage.offset)

    def _examine_record(self, found: Found) -> None:
        record = found.record
        if isinstance(record, records.Message):
            self._counts[record.channel_id] += 1
            if found.within is not None:
                self._index.setdefault(record.channel_id, []).append((record.log_time, found.within))
            return
        if found.within is not None:
            return
        match record:
            case Chunk():
                self._end_chunk()
                self._behind_damage = False
                self._found.chunks += 1
                self._chunk = record, found.offset
            case records.MessageIndex() if self._behind_damage:
                pass
            case records.MessageIndex():
                self._examine_index(record, found.offset)
            case records.Statistics():
                self._end_chunk()
                self._examine_statistics(record, found.offset)
            case _:
                self._end_chunk()

    def _examine_index(self, index: records.MessageIndex, offset: int) -> None:
        there = self._index.get(index.channel_id, [])
        if sorted(index.records) != sorted(there):
            message = (
                f"the index of channel {index.channel_id} is not that of the {counted(len(there), 'message')} before it"
            )
            self._add(FindingKind.WRONG, "index", message, offset)

    def _end_chunk(self) -> None:
        """Compare the times that a chunk states with those of its messages, once all of these have been read."""
        if self._chunk is not None:
            (chunk, offset), times = self._chunk, [each[0] for those in self._index.values() for each in those]
            if times and (min(times), max(times)) != (chunk.start_ns, chunk.end_ns):
                message = "the times that a chunk states are not those of its messages"
                self._add(FindingKind.WRONG, "chunk", message, offset)
        self._chunk = None
        self._index.clear()

    def _examine_statistics(self, statistics: records.Statistics, offset: int) -> None:
        if self._damages and self._accounted:
            return  # the ledger says what the damage has taken
        stated = {number: count for number, count in statistics.channel_message_counts.items() if count}
        total = sum(self._counts.values())
        if (stated and stated != dict(self._counts)) or statistics.message_count != total:
            message = f"the summary counts {statistics.message_count} messages, and {total} are there"
            if statistics.message_count == total:
                message = "the summary counts the messages of a channel otherwise than they are"
            self._add(FindingKind.WRONG, "statistics", message, offset)

    def _add(self, kind: FindingKind, code: str, message: str, offset: int | None) -> None:
        self._found.add(kind, code, message, self._name, offset)


def _examine_messages(bag: Bag, found: Examination, on_message: Callable[[], None]) -> list[int]:
    """Read every message by its type, and examine their numbers; return how many there are, by series."""
    counts = [0] * len(bag.series)
    faults: Counter[Channel] = Counter()
    unreadable: set[Channel] = set()
    before = [each.before for each in bag.series]
    for number, entry in bag.numbered():
        channel = entry.channel
        found.messages += 1
        counts[number] += 1
        on_message()
        repeated = not entry.sequence and bag.series[number].parts[0] is not None
        if bag.facts is not None and not repeated:
            is_later = entry.sequence > before[number]
            if not (is_later and bag.series[number].picked):  # which lacks the numbers of other topics
                for message in _out_of_sequence(before[number], entry.sequence):
                    kind = FindingKind.INCOMPLETE if is_later else FindingKind.WRONG
                    found.add(kind, "sequence", _prefix(bag, number) + message)
            before[number] = entry.sequence
        if channel in unreadable:
            continue
        try:
            channel.plain(entry.payload)
        except BagError as error:
            unreadable.add(channel)
            found.add(FindingKind.WRONG, "type", str(error))
        except MalformedMessage as error:
            faults[channel] += 1
            if faults[channel] <= _MOST_PER_CHANNEL:
                found.add(FindingKind.WRONG, "message", f"message {entry.sequence} of {channel.topic}: {error}")
    for channel, count in faults.items():
        if count > _MOST_PER_CHANNEL:
            more = f"{count - _MOST_PER_CHANNEL} more messages of {channel.topic} cannot be read"
            found.add(FindingKind.WRONG, "message", more)
    for channel in bag.channels:
        _examine_type(channel, found)
    return counts


def _out_of_sequence(before: int, number: int) -> Iterator[str]:
    if number > before + 1:
        last = f"message {before + 1} is" if number == before + 2 else f"messages {before + 1} to {number - 1} are"
        yield f"{last} missing"
    elif number <= before:
        yield f"message {number} comes after message {before}"


def _examine_type(channel: Channel, found: Examination) -> None:
    """Check the definition of a type against its hash."""
    if channel.type_hash is None or channel.encoding != "cdr":
        return
    try:
        read = channel.type.type_hash
    except BagError:
        return  # where it has messages, that was reported
    if read != channel.type_hash:
        message = f"{channel.topic}: the definition of {channel.type_name} has the hash {read}, not {channel.type_hash}"
        found.add(FindingKind.WRONG, "type", message)


def _examine_account(bag: Bag, found: Examination, counts: Sequence[int]) -> None:
    """Compare the ledgers with the messages that are there."""
    known = "" if bag.unfinished is None else bag.unfinished.reason
    if known:
        found.add(FindingKind.INCOMPLETE, "unfinished", known)
    for number, series in enumerate(bag.series):
        for kind, code, message in _contradictions(series, counts[number]):
            if message not in known:
                found.add(kind, code, _prefix(bag, number) + message)


def _contradictions(series: Series, there: int) -> Iterator[tuple[FindingKind, str, str]]:
    ledger = series.ledger
    if ledger is None and series.facts is None:
        return
    unfinished = any(each.unfinished for each in series.files)
    # Without gaps: each was reported.
    missing = list(shortfalls(ledger, unfinished=unfinished, gaps=0, there=there - series.repeated[0]))
    for code, text in missing:
        yield FindingKind.WRONG if code == "ledger" else FindingKind.INCOMPLETE, code, text
    if len(series.files) > 1 and not series.whole:
        yield FindingKind.INCOMPLETE, "unfinished", "parts of it are missing"
    partly = unfinished or series.reason or series.cut or not series.whole
    partly = partly or (series.facts and series.facts.recorded_by)
    if ledger is not None and not missing and not partly:  # else there are only the run's counts
        published = _published(ledger, elsewhere=bool(series.facts and series.facts.process))
        for name, count in series.counts_by_topic().items():
            least, most = published.get(name, (count, count))
            if name not in _RECORDERS_OWN and not least <= count <= most:
                are = "is" if count == 1 else "are"
                stated = f"the ledger says that {counted(most, 'message was', 'messages were')} published on {name}"
                yield FindingKind.WRONG, "ledger", f"{stated}, and {count} {are} there"


def _published(ledger: RunOutcome, *, elsewhere: bool) -> Mapping[str, tuple[int, int]]:
    """Return, by topic, the least and greatest number of published messages that the recording must have.

    Not all of the run's topics are recorded, and what only the recorder writes is not in the run's report. Of what came
    from other processes, those that record themselves have recorded most.
    """
    found: dict[str, tuple[int, int]] = {}
    for topic in ledger.topics:
        published, arrived = topic.get("published"), topic.get("arrived")
        if isinstance(published, int):
            least = published - arrived if elsewhere and isinstance(arrived, int) else published
            found[str(topic.get("name"))] = least, published
    return found


def _prefix(bag: Bag, number: int) -> str:
    """Return the prefix of a finding about one process's messages."""
    return "" if len(bag.series) == 1 else f"{bag.series[number].files[0].path.name}: "
