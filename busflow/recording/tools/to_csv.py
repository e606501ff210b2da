"""CSV: a file for each topic, a line for each message, a column for each field."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, cast

from busflow.errors import BagError
from busflow.interfaces.encoding.description import Count
from busflow.recording.tools.flat import Column, columns
from busflow.recording.tools.sink import MOST_FILES, FileNames

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel, Entry

_HEAD = ("log_time_ns", "sequence")
_MOST_COLUMNS = 64
"""Items of an array of fixed length that get a column each; longer ones, and others, share one, as JSON."""


class CsvFiles:
    """Writes a directory of CSV files."""

    def __init__(self, directory: Path) -> None:
        self._directory = directory
        self._names = FileNames(".csv")
        self._writers: dict[Channel, Callable[[Entry], None]] = {}
        self._streams: list[TextIO] = []

    def write(self, entry: Entry) -> None:
        """Write a line."""
        write = self._writers.get(entry.channel)
        if write is None:
            write = self._writers[entry.channel] = self._open(entry.channel)
        write(entry)

    def close(self) -> None:
        """Close the files."""
        for stream in self._streams:
            stream.close()

    def _open(self, channel: Channel) -> Callable[[Entry], None]:
        if len(self._streams) >= MOST_FILES:
            reason = f"it has more than {MOST_FILES} topics, and each becomes a file"
            raise BagError(reason, fix="pick some with --topics")
        those = columns(channel)
        stream = (self._directory / self._names.of(channel)).open("w", newline="", encoding="utf-8")
        self._streams.append(stream)
        writer = csv.writer(stream)
        names = ["message"] if those is None else [name for column in those for name in _names(column)]
        writer.writerow([*_HEAD, *names])

        def write(entry: Entry) -> None:
            message = channel.plain(entry.payload)
            cells = [_json(message)] if those is None else [cell for each in those for cell in _cells(each, message)]
            writer.writerow([entry.log_time_ns, entry.sequence, *cells])

        return write


def _spread(column: Column) -> bool:
    field = column.field
    return field.count is Count.FIXED and not field.nested and field.size <= _MOST_COLUMNS


def _names(column: Column) -> Iterator[str]:
    if _spread(column):
        yield from (f"{column.name}[{index}]" for index in range(column.field.size))
    else:
        yield column.name


def _cells(column: Column, message: Any) -> Iterator[object]:
    value = column.value(message)
    if _spread(column):
        yield from value
    else:
        yield value if column.field.count is Count.ONE else _json(value)


def _json(value: Any) -> str:
    """A value on one line; numbers that JSON does not have are written as Python writes them."""
    return json.dumps(value, default=_as_list, ensure_ascii=False)


def _as_list(value: object) -> list[Any]:
    return cast("memoryview[Any]", value).tolist()
