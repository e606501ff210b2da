"""CSV: a file for each topic, a line for each message, a column for each field."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from busflow.interfaces.encoding.description import Count
from busflow.recording.tools.flat import FieldColumn, columns

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel, Entry

_HEAD = ("log_time_ns", "sequence")
_MOST_COLUMNS = 64
"""Items of an array of fixed length that get a column each; longer ones, and others, share one, as JSON."""


class CsvFile:
    """Writes the messages of one topic."""

    def __init__(self, path: Path, channel: Channel) -> None:
        """Begin a file with its line of names.

        Raises:
            BagError: Messages of this channel cannot be read.
        """
        self._columns = columns(channel)
        self._stream = path.open("w", newline="", encoding="utf-8")
        self._writer = csv.writer(self._stream)
        names = ["message"] if self._columns is None else [name for each in self._columns for name in _names(each)]
        self._writer.writerow([*_HEAD, *names])

    def write(self, entry: Entry) -> None:
        """Write a line."""
        message = entry.channel.plain(entry.payload)
        those = self._columns
        cells = [_json(message)] if those is None else [cell for each in those for cell in _cells(each, message)]
        self._writer.writerow([entry.log_time_ns, entry.sequence, *cells])

    def close(self) -> None:
        """Close the file."""
        self._stream.close()


def _spread(column: FieldColumn) -> bool:
    field = column.field
    return field.count is Count.FIXED and not field.nested and field.size <= _MOST_COLUMNS


def _names(column: FieldColumn) -> Iterator[str]:
    if _spread(column):
        yield from (f"{column.name}[{index}]" for index in range(column.field.size))
    else:
        yield column.name


def _cells(column: FieldColumn, message: Any) -> Iterator[object]:
    value = column.value(message)
    if _spread(column):
        yield from value
    else:
        yield value if column.field.count is Count.ONE else _json(value)


def _json(value: Any) -> str:
    """Return a value on one line; numbers that JSON does not have are written as Python writes them."""
    return json.dumps(value, default=_as_list, ensure_ascii=False)


def _as_list(value: object) -> list[Any]:
    return cast("memoryview[Any]", value).tolist()
