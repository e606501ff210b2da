"""Conversion: writes the messages of a bag in another form, completely or not at all."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from enum import StrEnum
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from busflow.errors import BagError, MalformedMessage
from busflow.recording.bag.channel import Channel, Entry, unreadable
from busflow.recording.bag.kept import kept
from busflow.recording.bag.series import renumbered
from busflow.recording.tools.cut import cut_of, words_of
from busflow.recording.tools.flat import listed
from busflow.recording.tools.sink import Sink, TopicFiles
from busflow.recording.tools.target import new_directory, new_file

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag


class TargetFormat(StrEnum):
    """The formats to which a bag is converted."""

    ROS2BAG = "ros2bag"
    CSV = "csv"
    PARQUET = "parquet"
    JSONL = "jsonl"
    MCAP = "mcap"

    @property
    def is_directory(self) -> bool:
        """True if the format is a directory of several files."""
        return self in (TargetFormat.ROS2BAG, TargetFormat.CSV, TargetFormat.PARQUET)

    def fault(self, channel: Channel) -> BagError | None:
        """Return the reason why messages of a channel cannot be written in this format; None if they can."""
        if self is TargetFormat.ROS2BAG and channel.encoding == "cdr" and not channel.type_hash:
            return channel.fault  # a reader of ROS 2 wants the hash of each type, which is made of its definition
        if self in (TargetFormat.ROS2BAG, TargetFormat.MCAP):
            return None  # their bytes are copied
        if self is TargetFormat.PARQUET and channel.encoding == "json":
            reason = f"{channel.topic} is encoded as JSON, whose messages have no columns"
            return BagError(reason, fix="pick other topics with --topics, or --to jsonl")
        return channel.fault


@dataclass(slots=True)
class Converted:
    """The account of a conversion."""

    messages: int = 0
    left_out: int = 0
    """Messages that could not be read by their type, or whose type could not be read."""
    faults: dict[Channel, str] = field(default_factory=dict["Channel", str])
    """The reason for the first fault of each channel."""


def convert(
    bag: Bag,
    target: Path | TextIO,
    form: TargetFormat,
    line_of: Callable[[Mapping[str, Any]], str],
    *,
    channels: Collection[Channel] | None = None,
    times: tuple[int | None, int | None] = (None, None),
    on_message: Callable[[], None] = lambda: None,
) -> Converted:
    """Write the messages of a bag in another form.

    Args:
        bag: The bag.
        target: The file or directory to make, which must not exist; or the stream that gets JSON Lines.
        form: The form.
        line_of: Makes a line of JSON of an object.
        channels: Only the messages of these.
        times: Only messages recorded between these, in nanoseconds.
        on_message: Is called after each message.

    Raises:
        BagError: The target exists or cannot be written, messages cannot be written in this form, or there is no
            channel that can be read.
    """
    chosen = bag.channels if channels is None else channels
    done = Converted(faults={channel: str(fault) for channel, fault in unreadable(chosen, form.fault).items()})
    wanted = frozenset(chosen).__contains__
    start_ns, first_ns = times[0], bag.start_ns
    later = start_ns is not None and first_ns is not None and start_ns > first_ns
    repeats = kept(bag, wanted, start_ns) if later and start_ns is not None else []
    rest = _entries(bag, None if channels is None else wanted, *times, later=later)
    first = next(rest, None)
    entries = chain(repeats, [] if first is None else [first], rest)
    if not isinstance(target, Path):
        return _write(JsonlFile(target, line_of), entries, done, on_message)
    chosen = [each for each in chosen if each not in done.faults]
    part = words_of(bag, cut_of(bag, chosen, times), repeats, 1 if first is None else first.sequence)
    place = new_directory(target) if form.is_directory else new_file(target)
    with place as path, closing(_sink(form, path, target, bag, line_of, chosen, part)) as sink:
        return _write(sink, entries, done, on_message)


def _write(sink: Sink, entries: Iterator[Entry], done: Converted, on_message: Callable[[], None]) -> Converted:
    left_out = set(done.faults)
    for entry in entries:
        if entry.channel in left_out:
            done.left_out += 1
        else:
            try:
                sink.write(entry)
                done.messages += 1
            except MalformedMessage as error:
                done.left_out += 1
                done.faults.setdefault(entry.channel, f"message {entry.sequence} of {entry.channel.topic}: {error}")
        on_message()
    return done


def _entries(
    bag: Bag, wanted: Callable[[Channel], bool] | None, start_ns: int | None, end_ns: int | None, *, later: bool
) -> Iterator[Entry]:
    """Return the messages; those of several processes get numbers over all of them, since each has begun at 1."""
    if len(bag.series) == 1:
        return bag.entries(wanted, start_ns, end_ns)
    return renumbered(bag.numbered(wanted, start_ns, end_ns), [None if later else each.before for each in bag.series])


def _sink(
    form: TargetFormat,
    path: Path,
    target: Path,
    bag: Bag,
    line_of: Callable[[Mapping[str, Any]], str],
    channels: Collection[Channel],
    part: Mapping[str, str],
) -> Sink:
    """Return a sink for the messages; imports only the libraries of its format."""
    match form:
        case TargetFormat.CSV:
            from busflow.recording.tools.to_csv import CsvFile

            return TopicFiles(path, ".csv", CsvFile)
        case TargetFormat.PARQUET:
            from busflow.recording.tools.to_parquet import parquet_files

            return parquet_files(path)
        case TargetFormat.JSONL:
            return JsonlFile(path.open("w", encoding="utf-8"), line_of)
        case TargetFormat.ROS2BAG:
            from busflow.recording.tools.to_mcap import Rosbag2Directory

            return Rosbag2Directory(path, target.name, bag, channels, part)
        case TargetFormat.MCAP:
            from busflow.recording.tools.to_mcap import McapCopy

            return McapCopy(path.open("wb"), bag, channels, part)


class JsonlFile:
    """Writes lines."""

    def __init__(self, stream: TextIO, line_of: Callable[[Mapping[str, Any]], str]) -> None:
        """Write to a stream; `line_of` makes a line of an object."""
        self._stream, self._line_of = stream, line_of

    def write(self, entry: Entry) -> None:
        """Write a line."""
        channel = entry.channel
        line = self._line_of(
            {
                "topic": channel.topic,
                "type": channel.type_name,
                "sequence": entry.sequence,
                "log_time_ns": entry.log_time_ns,
                "publish_time_ns": entry.publish_time_ns,
                "message": listed(channel.plain(entry.payload)),
            }
        )
        self._stream.write(line + "\n")

    def close(self) -> None:
        """Close the stream."""
        self._stream.close()
