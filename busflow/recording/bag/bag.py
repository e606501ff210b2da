"""`Bag`: a recording to read: an MCAP file, or a directory of rosbag2 with the files of one process or of several.

It yields everything that can be read, in the order of recording. If the recording is damaged or cut off, `damage` says
afterwards where and why. Memory holds one chunk of each process at a time.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import replace
from pathlib import Path
from struct import Struct
from typing import Self

from busflow.bus.names import absolute_name
from busflow.errors import BagError
from busflow.recording.bag.bag_file import SINCE, UNTIL, BagFile, Survey
from busflow.recording.bag.channel import Channel, Entry
from busflow.recording.bag.facts import FACTS, PART, Cut, Facts, RunOutcome, part_of, summed
from busflow.recording.bag.mcap_file import McapFile
from busflow.recording.bag.series import Damage, Numbered, Series, merged

_DIGESTED = Struct("<IIIQQ")
_DATABASE = ".db3"
"""The suffix of a file that is read without a directory and its metadata."""
_NUMBER = re.compile(r"_\d+(?=\.mcap$)")
"""The number of a part, at the end of its name."""


class Bag:
    """A recording, opened for reading.

    Only its beginning and its end are read until a caller asks for something that needs the messages.
    """

    def __init__(self, path: str | Path) -> None:
        """Open a recording.

        Raises:
            BagError: It is not a recording, or cannot be opened.
        """
        self.path: Path = Path(path)
        self.files: Sequence[BagFile] = ()
        self.unfinished: BagError | None = None
        """The reason why the bag itself, not one of its files, is known to be unfinished."""
        self.report: Mapping[str, object] = {}
        """The report of a run of several processes; each file has only that of its own process."""
        self._kept_open = ExitStack()
        self._open()
        self.series: tuple[Series, ...] = self._grouped()
        """Its files, in groups whose messages were numbered together: one, or one of each process and life."""

    def close(self) -> None:
        """Close it; MCAP files are open only while they are read."""
        self._kept_open.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def channels(self) -> tuple[Channel, ...]:
        """The topics, sorted by name; without a summary, the whole bag is read for this."""
        counts = self._overview().counts
        return tuple(replace(each, count=counts[each]) for each in sorted(counts, key=lambda each: each.topic))

    @property
    def damages(self) -> tuple[Damage, ...]:
        """The place and reason where reading stopped; known after the bag was read that far."""
        return tuple(each.damage for each in self.series if each.damage is not None)

    @property
    def damage(self) -> Damage | None:
        """The first of them."""
        return next(iter(self.damages), None)

    @property
    def facts(self) -> Facts | None:
        """The set-up of the run; None for a recording of another program."""
        return next((each.facts for each in self.series if each.facts is not None), None)

    @property
    def ledger(self) -> RunOutcome | None:
        """The run's account at its end; None without a busflow recording of the end."""
        if len(self.series) == 1:
            return self.series[0].ledger
        return summed([each.ledger for each in self.series], self.report)

    @property
    def start_ns(self) -> int | None:
        """The earliest log time; None where there is no message."""
        return self._overview().start_ns

    @property
    def end_ns(self) -> int | None:
        """The latest log time."""
        return self._overview().end_ns

    @property
    def messages(self) -> int:
        """The number of messages."""
        return self._overview().messages

    def spans(self) -> Mapping[Channel, tuple[int, int]]:
        """Return the times of each channel's first and last message; empty if the whole bag would have to be read."""
        found: dict[Channel, tuple[int, int]] = {}
        for series in self.series:
            spans = series.spans()
            if spans is None:
                return {}
            for channel, (first, last) in spans.items():
                known = found.get(channel, (first, last))
                found[channel] = min(first, known[0]), max(last, known[1])
        return found

    def entries(
        self,
        topics: Collection[str] | Callable[[Channel], bool] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Generator[Entry]:
        """Return the messages in the order in which they were recorded, up to where the bag is damaged.

        A file is open from the first of them to the last; a caller that stops earlier closes the generator.

        Args:
            topics: Only those on these topics, or of channels for which this is true.
            start_ns: Only those of this log time or later.
            end_ns: Only those of this log time or earlier.
        """
        if len(self.series) == 1:
            return self.series[0].entries(_chosen(topics), *_bounds(start_ns, end_ns))
        return (entry for _, entry in self.numbered(topics, start_ns, end_ns))

    def numbered(
        self,
        topics: Collection[str] | Callable[[Channel], bool] | None = None,
        start_ns: int | None = None,
        end_ns: int | None = None,
    ) -> Iterator[Numbered]:
        """Return the messages as `entries` does, each with the index of its series in `series`."""
        wanted, bounds = _chosen(topics), _bounds(start_ns, end_ns)
        return merged([each.entries(wanted, *bounds) for each in self.series])

    def survey(self) -> Survey:
        """Read all of it, once: counts, times and gaps as the messages themselves show them."""
        return Survey.of([each.survey() for each in self.series])

    @property
    def cuts(self) -> tuple[Cut, ...]:
        """Its places in other recordings, each once, if it was converted from a part of one."""
        return tuple(dict.fromkeys(each.cut for each in self.series if each.cut is not None))

    @property
    def incomplete(self) -> tuple[str, ...]:
        """The reasons why the recording is incomplete; empty if nothing is missing, as far as it has been read."""
        known = "" if self.unfinished is None else self.unfinished.reason
        reasons = [known] if known else []
        for each in self.series:
            file = "" if len(self.series) == 1 else f"{each.files[0].path.name}: "
            reasons += [file + reason for reason in each.incomplete() if reason not in known]
        return tuple(reasons)

    @property
    def complete(self) -> bool:
        """True if nothing is missing, as far as the recording has been read."""
        return not self.incomplete

    def digest(self) -> str:
        """Return the SHA-256 of topic, type, log time, sequence and bytes of every message, in order."""
        found = hashlib.sha256()
        for channel, sequence, log_time, _, payload in self.entries():
            topic, type_name = channel.topic.encode(errors="replace"), channel.type_name.encode(errors="replace")
            found.update(_DIGESTED.pack(len(topic), len(type_name), sequence, log_time, len(payload)))
            found.update(topic + type_name + payload)
        return found.hexdigest()

    def _open(self) -> None:
        if not self.path.is_dir() and not (self.path.suffix == _DATABASE and self.path.is_file()):
            self.files = (McapFile(self.path),)
            return
        from busflow.recording.bag.rosbag2 import Directory, directory

        found = directory(self.path) if self.path.is_dir() else Directory((self.path,), "sqlite3")
        self.unfinished, self.report = found.unfinished, found.report
        if found.storage == "mcap" and not found.compressed:
            self.files = self._files(found.files)
            return
        from busflow.recording.bag.rosbags_file import RosbagsFile

        parts = [(self.path, found.files)] if found.compressed else [(each, (each,)) for each in found.files]
        self.files = tuple(self._kept_open.enter_context(closing(RosbagsFile(*part))) for part in parts)

    def _files(self, paths: Sequence[Path]) -> tuple[BagFile, ...]:
        """Return the files of a directory; a part may be gone, and a process killed before it recorded anything.

        Raises:
            BagError: One is no recording, and the others cannot be read without it.
        """
        files: list[BagFile] = []
        refused: BagError | None = None
        for each in paths:
            try:
                files.append(McapFile(each))
            except BagError as error:
                refused = refused or error
        if refused is not None:
            if not any(_process(each) or PART in each.metadata for each in files):
                raise refused
            reason = f"{Path(refused.file or '').name}: {refused.reason}"
            self.unfinished = self.unfinished or BagError(reason, file=str(self.path))
        return tuple(files)

    def _grouped(self) -> tuple[Series, ...]:
        groups: dict[str, list[BagFile]] = {}
        apart = any(map(_process, self.files))
        for each in self.files:
            groups.setdefault(_undivided(each) if apart else "", []).append(each)
        return tuple(Series(each, str(self.path)) for each in groups.values() or [self.files])

    def _overview(self) -> Survey:
        return Survey.of([each.overview() for each in self.series])


def _process(file: BagFile) -> str:
    """Return the process that has recorded a file for itself alone."""
    return file.metadata.get(FACTS, {}).get("process", "")


def _undivided(file: BagFile) -> str:
    """Return the name of a process's file, which its parts have in common."""
    name = file.path.name
    part = part_of(file.metadata[PART]) if PART in file.metadata else None
    return name if part is None or part.reason else _NUMBER.sub("", name)


def _bounds(start_ns: int | None, end_ns: int | None) -> tuple[int, int]:
    return SINCE if start_ns is None else max(start_ns, SINCE), UNTIL if end_ns is None else end_ns


def _chosen(topics: Collection[str] | Callable[[Channel], bool] | None) -> Callable[[Channel], bool]:
    if topics is None:
        return lambda _: True
    if callable(topics):
        return topics
    names = {absolute_name(name) for name in topics} | set(topics)
    return lambda channel: channel.topic in names
