"""JSON Lines: one file, a line for each message, in the order in which they were recorded."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TextIO

from busflow.recording.tools.flat import listed

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Entry


class JsonlFile:
    """Writes lines."""

    def __init__(self, stream: TextIO, line_of: Callable[[Mapping[str, Any]], str]) -> None:
        """Write to a stream, with what makes a line of an object."""
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
