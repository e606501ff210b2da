"""Series: the files of a bag that were numbered together, and the merge of several series.

The merge is by log time, each series in its own order, ties by the order of the series. The processes of a run read the
same clock of the same machine; nothing more is known of their order.
"""

from __future__ import annotations

import heapq
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from busflow.errors import BagError
from busflow.recording.bag.bag_file import SINCE, UNTIL, BagFile, Survey
from busflow.recording.bag.channel import Channel, Entry
from busflow.recording.bag.completeness import shortfalls
from busflow.recording.bag.facts import (
    FACTS,
    LEDGER,
    PART,
    BagPart,
    Cut,
    Facts,
    RunOutcome,
    facts_of,
    joined,
    ledger_of,
    part_of,
)
from busflow.text import counted

Numbered = tuple[int, Entry]
"""A message, and the number of its series."""


def merged(series: Sequence[Iterable[Entry]]) -> Iterator[Numbered]:
    """Return all messages, the earliest first.

    Where a series' own clock was set back, what it recorded then comes at once: its order is never changed.
    """
    lanes = [_numbered(number, each) for number, each in enumerate(series)]
    return heapq.merge(*lanes, key=lambda found: found[1].log_time_ns)


def renumbered(found: Iterable[Numbered], before: Iterable[int | None]) -> Iterator[Entry]:
    """Yield the messages with numbers over all of them; what is missing in a series leaves as large a gap.

    Args:
        found: the messages.
        before: for each series the number after which its messages begin; None if they begin with any number.
    """
    last = dict(enumerate(before))
    number = 0
    for series, entry in found:
        known = last[series]
        number += 1 if known is None else max(1, entry.sequence - known)
        last[series] = entry.sequence or last[series]  # a repeat has none
        yield entry._replace(sequence=number)


def _numbered(number: int, entries: Iterable[Entry]) -> Iterator[Numbered]:
    return ((number, entry) for entry in entries)


@dataclass(frozen=True, slots=True)
class Damage:
    """The place and reason where reading a recording stopped."""

    file: str
    offset: int | None
    what: str
    served: int
    """The messages before it."""

    def __str__(self) -> str:
        where = "" if self.offset is None else f" at byte {self.offset}"
        come = counted(self.served, "message comes", "messages come")
        return f"{self.file}{where}: {self.what}; {come} before it"


class Series:
    """Files that are read one after the other."""

    def __init__(self, files: Sequence[BagFile], place: str) -> None:
        """Create a series of files; `place` names it in damage that belongs to none of them."""
        self.files: tuple[BagFile, ...] = tuple(files)
        self.damage: Damage | None = None
        """The reason why it could not be read to its end; known after it was read that far."""
        self._place = place
        self.parts: tuple[BagPart | None, ...] = tuple(_part(each) for each in self.files)
        """The place of each file in a recording that was split; None in another one."""
        self._survey: Survey | None = None
        self._stated: Survey | None = None

    @property
    def facts(self) -> Facts | None:
        """The set-up of the run; None for a recording of another program."""
        for file in self.files:
            if FACTS in file.metadata:
                return facts_of(file.metadata[FACTS], file.launch_file)
        return None

    @property
    def ledger(self) -> RunOutcome | None:
        """The run's account at its end; None without a busflow recording of the end."""
        words = [file.metadata[LEDGER] for file in self.files if LEDGER in file.metadata]
        if not words or (self.parts[-1] is not None and LEDGER not in self.files[-1].metadata):
            return None
        found = ledger_of(joined(words))
        return found if len(words) == len(self.files) else replace(found, recorded=None)

    @property
    def before(self) -> int:
        """The number after which those of its messages begin: 0 but for a later part of a recording."""
        first = self.parts[0] if self.parts else None
        return 0 if first is None else first.first - 1

    @property
    def repeated(self) -> tuple[int, ...]:
        """The number of messages in each file that an earlier part has too; they are read in the first file only."""
        return tuple(0 if each is None else sum(each.repeated.values()) for each in self.parts)

    @property
    def reason(self) -> str:
        """What it shows, if it is a snapshot of a run's last moments."""
        return next((each.reason for each in self.parts if each is not None), "")

    @property
    def cut(self) -> Cut | None:
        """Its place in another recording, if it was converted from a part of it."""
        return next((each.cut for each in self.parts if each is not None), None)

    @property
    def picked(self) -> bool:
        """True if topics were left out of it, so that numbers are missing."""
        return self.cut is not None and bool(self.cut.without)

    @property
    def whole(self) -> bool:
        """True unless it is one part, or some parts, of a recording that was split."""
        ledger = self.ledger
        numbers = [each.number for each in self.parts if each is not None]
        return numbers == list(range(len(numbers))) and not (ledger is not None and ledger.continued)

    def entries(
        self, wanted: Callable[[Channel], bool] = lambda _: True, since_ns: int = SINCE, until_ns: int = UNTIL
    ) -> Generator[Entry]:
        """Yield the messages in the order in which they were recorded, up to where a file is damaged."""
        served = 0
        for place, file in enumerate(self.files):
            items = file.walk(wanted, since_ns, until_ns)
            if place and self.parts[place] is not None:
                items = _new(items)
            try:
                for item in items:
                    if type(item) is Entry:
                        served += 1
                        yield item
            except BagError as error:
                self.damage = Damage(error.file or self._place, error.offset, error.reason, served)
                return

    def survey(self) -> Survey:
        """Read all of it, once: counts, times and gaps as the messages themselves show them."""
        if self._survey is None:
            self._survey = self._surveyed()
        return self._survey

    def overview(self) -> Survey:
        """Return the contents as the files' summaries state them, or, where one lacks it, as reading shows."""
        if self._survey is None and self._stated is None:
            found = [each.overview() for each in self.files]
            stated = [
                each if part is None or not place else _without(each, part.repeated)
                for place, (each, part) in enumerate(zip(found, self.parts, strict=True))
                if each is not None
            ]
            self._stated = Survey.of(stated) if len(stated) == len(found) else None
        return self._survey or self._stated or self.survey()

    def spans(self) -> Mapping[Channel, tuple[int, int]] | None:
        """Return the times of each channel's first and last message; None where a whole file would have to be read."""
        found: dict[Channel, tuple[int, int]] = {}
        for place, (file, part) in enumerate(zip(self.files, self.parts, strict=True)):
            spans = file.spans()
            if spans is None:
                return None
            overview = file.overview() if place and part is not None else None
            for channel, (first, last) in spans.items():
                if overview is None or part is None or overview.counts[channel] > part.repeated.get(channel.topic, 0):
                    known = found.get(channel, (first, last))
                    found[channel] = min(first, known[0]), max(last, known[1])
        return found

    def counts_by_topic(self) -> Mapping[str, int]:
        """Return the number of messages of each topic, over all offered QoS."""
        counts: Counter[str] = Counter()
        for channel, count in self.overview().counts.items():
            counts[channel.topic] += count
        return counts

    def incomplete(self) -> Iterator[str]:
        """Yield the reasons why the recording is incomplete, as far as it has been read."""
        if self.damage is not None:  # which says the same of a file without an end, and where
            yield self.damage.what
        else:
            yield from (each.unfinished.reason for each in self.files if each.unfinished)
        ledger = self.ledger
        if self.facts is not None or ledger is not None:
            gaps = 0 if self._survey is None else self._survey.gaps
            unfinished = any(each.unfinished for each in self.files)
            if len(self.files) > 1 and not self.whole:
                yield "parts of it are missing"
            for each in shortfalls(
                ledger, unfinished=unfinished, gaps=gaps, there=self.overview().messages - self.repeated[0]
            ):
                yield each.text

    def _surveyed(self) -> Survey:
        counts: Counter[Channel] = Counter()
        first, last, before, gaps = None, None, self.before, 0
        for channel, sequence, log_time, _, _ in self.entries():
            counts[channel] += 1
            first = log_time if first is None or log_time < first else first
            last = log_time if last is None or log_time > last else last
            gaps += max(0, sequence - before - 1)
            before = sequence or before  # a repeat has none
        for file in self.files:
            counts.update(dict.fromkeys(file.channels, 0))
        return Survey(counts, first, last, gaps if self.facts is not None and not self.picked else 0)


def _part(file: BagFile) -> BagPart | None:
    return part_of(file.metadata[PART]) if PART in file.metadata else None


def _new(items: Iterable[object]) -> Iterator[object]:
    """Yield what an earlier part does not have; repeats have no number."""
    return (item for item in items if type(item) is not Entry or item.sequence)


def _without(found: Survey, repeated: Mapping[str, int]) -> Survey:
    """Return the contents of a part without its repeats."""
    counts = {channel: max(0, count - repeated.get(channel.topic, 0)) for channel, count in found.counts.items()}
    return replace(found, counts=counts)
