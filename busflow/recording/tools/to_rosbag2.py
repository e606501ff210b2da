"""A directory of rosbag2: an MCAP file with the `metadata.yaml` by which ROS 2 finds its way in it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from busflow.errors import BagError, MalformedMessage
from busflow.recording.bag.offered_qos import offered, offered_qos_profiles
from busflow.recording.bag.rosbag2_metadata import FileCounts, write_metadata
from busflow.recording.tools.to_mcap import McapCopy

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel, Entry


class Rosbag2Directory:
    """Writes a directory that `ros2 bag` reads."""

    def __init__(self, directory: Path, name: str, bag: Bag, channels: Iterable[Channel], *, partly: bool) -> None:
        """Begin a bag of this name in a directory that is there."""
        self._directory, self._file = directory, f"{name}_0.mcap"
        self._counts: Counter[Channel] = Counter({each: 0 for each in channels if each.encoding == "cdr"})
        # Readers match a topic of the file with one of the metadata only if both offer the same.
        stream = (directory / self._file).open("wb")
        self._copy = McapCopy(stream, bag, self._counts, partly=partly, qos=_profiles)
        self._first, self._last = (1 << 63) - 1, 0

    def write(self, entry: Entry) -> None:
        """Write a message."""
        if entry.channel not in self._counts:
            raise MalformedMessage(f"it is encoded as {entry.channel.encoding}, which ROS 2 does not read")
        self._copy.write(entry)
        self._counts[entry.channel] += 1
        self._first, self._last = min(self._first, entry.log_time_ns), max(self._last, entry.log_time_ns)

    def close(self) -> None:
        """Write the end of the file, and the metadata."""
        self._copy.close()
        times = (self._first, self._last) if self._counts.total() else (None, None)
        write_metadata(self._directory, [FileCounts(self._file, self._counts, *times)], qos=_profiles)


def _profiles(channel: Channel) -> str:
    """What was offered, in the words of this version of the metadata, whatever version the bag has."""
    try:
        found = offered(channel.qos)
    except BagError:  # nobody could have read it
        found = None
    return "" if found is None else offered_qos_profiles([found])
