"""Parquet: a file for each topic, a row for each message, a column for each field; sequences are lists in a column.

It is written with pyarrow, which comes with busflow's extra `parquet` and is imported when it is needed.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from busflow.errors import BagError, how_to_install
from busflow.interfaces.encoding.description import Count, Field, IndividualDescription, fields_of, types_in
from busflow.recording.tools.flat import columns
from busflow.recording.tools.sink import TopicFiles

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel, Entry

_MOST_ROWS = 5000
_MOST_BYTES = 4 << 20
"""Rows, and bytes of messages, that are kept for a file until they are written together."""
_WORDS = {"byte": "uint8", "char": "uint8", "wstring": "string", "bool": "bool_"}
"""Arrow's names of ROS types for which it has another word."""


def parquet_files(directory: Path) -> TopicFiles:
    """Return a sink that writes a directory of Parquet files.

    Raises:
        BagError: pyarrow is not installed.
    """
    _arrow()
    return TopicFiles(directory, ".parquet", ParquetFile)


class ParquetFile:
    """Writes the messages of one topic."""

    def __init__(self, path: Path, channel: Channel) -> None:
        """Begin a file.

        Raises:
            BagError: Messages of this channel cannot be read.
        """
        arrow, parquet = _arrow()
        self._arrow, self._channel = arrow, channel
        self._columns = columns(channel) or ()
        fields = [("log_time_ns", arrow.uint64()), ("sequence", arrow.uint32())]
        types = types_in(channel.type.description)
        fields += [(each.name, _arrow_type(arrow, each.field, types)) for each in self._columns]
        self._schema = arrow.schema(fields, metadata={"topic": channel.topic, "type": channel.type_name})
        self._writer = parquet.ParquetWriter(path, self._schema, compression="zstd")
        self._rows: list[list[Any]] = [[] for _ in fields]
        self._bytes = 0

    def write(self, entry: Entry) -> None:
        """Add a row."""
        message = self._channel.plain(entry.payload)
        values = [entry.log_time_ns, entry.sequence, *(_value(each.value(message)) for each in self._columns)]
        for column, value in zip(self._rows, values, strict=True):
            column.append(value)
        self._bytes += len(entry.payload)
        if self._bytes > _MOST_BYTES or len(self._rows[0]) >= _MOST_ROWS:
            self._flush()

    def close(self) -> None:
        """Write the rows that are left, and the end."""
        self._flush()
        self._writer.close()

    def _flush(self) -> None:
        arrays = [self._arrow.array(rows, field.type) for rows, field in zip(self._rows, self._schema, strict=True)]
        self._writer.write_table(self._arrow.Table.from_arrays(arrays, schema=self._schema))
        for rows in self._rows:
            rows.clear()
        self._bytes = 0


def _value(value: Any) -> Any:
    """Return a field's value as Arrow takes it at once: an array of numbers by its buffer, not number by number."""
    return np.asarray(value) if isinstance(value, memoryview) else value


def _arrow() -> tuple[Any, Any]:
    """Import Arrow and its Parquet; without types, for it has none."""
    try:
        return import_module("pyarrow"), import_module("pyarrow.parquet")
    except ImportError:
        fix = how_to_install("busflow[parquet]")
        raise BagError("Parquet is written with pyarrow, which is not here", fix=fix) from None


def _arrow_type(arrow: Any, field: Field, types: dict[str, IndividualDescription]) -> Any:
    if field.nested:
        inner = types[field.base]
        # One without fields keeps ROS 2's dummy, for Parquet has no structure of nothing.
        item = arrow.struct([(each.name, _arrow_type(arrow, each, types)) for each in fields_of(inner)])
    else:
        item = getattr(arrow, _WORDS.get(field.base, field.base))()
    match field.count:
        case Count.ONE:
            return item
        case Count.FIXED:
            return arrow.list_(item, field.size)
        case _:
            return arrow.list_(item)
