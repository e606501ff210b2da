"""`RosbagsFile`: a database of a bag, or a directory in which files or messages are compressed, read with rosbags.

The library comes with busflow's extra `rosbags`, and is imported when such a bag is opened.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import yaml

from busflow.errors import BagError, how_to_install
from busflow.recording.bag.bag_file import SINCE, UNTIL, Survey
from busflow.recording.bag.channel import Channel, Entry

if TYPE_CHECKING:
    from rosbags.interfaces import Connection, ConnectionExtRosbag2
    from rosbags.rosbag2 import Reader

_LARGEST_NS = (1 << 63) - 1
"""SQLite's integers are of 64 bits with a sign."""
_ENCODINGS = {"MSG": "ros2msg", "IDL": "ros2idl"}


class RosbagsFile:
    """The part of a bag that rosbags reads as one: a file, or all files of a directory."""

    launch_file: str | None = None
    recorder = "rosbag2, read with rosbags"

    def __init__(self, path: Path, parts: Sequence[Path]) -> None:
        """Open a database, or a directory with these files, and read its topics.

        Raises:
            BagError: It is not a recording, or rosbags is not installed.
        """
        self.path = path
        self.metadata: dict[str, dict[str, str]] = {}
        self.unfinished: BagError | None = None
        self._idle: Reader | None = None
        self._keeps = True
        with self._opened() as reader:
            self.size: int = sum(each.stat().st_size for each in parts)
            self._topics = {each.id: _channel(each) for each in reader.connections}
            counts = {self._topics[each.id]: each.msgcount for each in reader.connections}
            times = (reader.start_time, reader.end_time - 1) if reader.message_count else (None, None)
            self._overview = Survey(counts, *times)

    @property
    def channels(self) -> Collection[Channel]:
        """Its topics."""
        return self._topics.values()

    def overview(self) -> Survey | None:
        """Return the counts of the database, or of the directory's `metadata.yaml`."""
        return self._overview

    def spans(self) -> Mapping[Channel, tuple[int, int]] | None:
        """Return None: rosbags has no times of single topics."""
        return None

    def walk(self, wanted: Callable[[Channel], bool], since_ns: int = SINCE, until_ns: int = UNTIL) -> Iterator[Entry]:
        """Yield the messages of each file by their times; a database numbers none of them.

        Raises:
            BagError: The database is damaged.
        """
        with self._opened() as reader:
            chosen = [each for each in reader.connections if wanted(self._topics[each.id])]
            times = {} if (since_ns, until_ns) == (SINCE, UNTIL) else _times(since_ns, until_ns)
            count = 0
            for connection, time_ns, data in reader.messages(chosen, **times) if chosen else ():
                if type(data) is not bytes or type(time_ns) is not int:  # a column may hold a value of any type
                    raise self._damaged(f"message {count + 1} is {type(data).__name__} at {time_ns!r}")
                count += 1
                yield Entry(self._topics[connection.id], 0, time_ns, time_ns, data)
            stated = sum(each.msgcount for each in chosen)
            if not times and count != stated:  # of topics in the database that are not in the metadata it reads nothing
                raise self._damaged(f"{stated} messages are announced, and {count} are there")

    def close(self) -> None:
        """Close it, and remove what was unpacked, now or when it is no longer read."""
        self._keeps = False
        self._let_go(self._idle)

    @contextmanager
    def _opened(self) -> Generator[Reader]:
        """Lend a reader to the block. One is kept open: opening counts all messages, and unpacks compressed files."""
        try:
            reader, self._idle = self._idle or self._open(), None
            try:
                yield reader
            finally:
                self._let_go(self._idle if self._keeps else reader)
                self._idle = reader if self._keeps else None
        except BagError:
            raise
        except Exception as error:  # noqa: BLE001  # rosbags lets through whatever SQLite, zstd and Python say of damage
            raise self._damaged(str(error)) from None

    def _let_go(self, reader: Reader | None) -> None:
        if reader is not None:
            reader.close()
        self._idle = None

    def _open(self) -> Reader:
        try:
            from rosbags.rosbag2 import Reader
        except ImportError:
            reason = "a database, or a compressed bag, is read with rosbags, which is not installed"
            raise BagError(reason, file=str(self.path), fix=how_to_install("busflow[rosbags]")) from None
        reader = Reader(self.path)
        reader.open()
        return reader

    def _damaged(self, why: str) -> BagError:
        fix = "sqlite3 has .recover" if self.path.suffix == ".db3" else None
        return BagError(f"it cannot be read: {why}", file=str(self.path), fix=fix)


def _channel(connection: Connection) -> Channel:
    """Return a topic, as rosbags describes it."""
    details = cast("ConnectionExtRosbag2", connection.ext)
    return Channel(
        connection.topic,
        connection.msgtype,
        details.serialization_format,
        connection.msgdef.data,
        _ENCODINGS.get(connection.msgdef.format.name, ""),
        connection.digest or None,
        _qos(details.offered_qos_profiles),
    )


def _qos(profiles: Sequence[Any]) -> str | None:
    """Return profiles as ROS 2 writes them; None if there are none."""
    policies = [{name: _policy(value) for name, value in each._asdict().items()} for each in profiles]
    return yaml.safe_dump(policies, sort_keys=False) if policies else None


def _policy(value: Any) -> object:
    if hasattr(value, "_asdict"):
        return dict(value._asdict())  # a time
    return value.name.lower() if hasattr(value, "name") else value


def _times(since_ns: int, until_ns: int) -> dict[str, int]:
    """Return a stretch of time in rosbags' words, whose end is beyond the last message."""
    return {"start": min(since_ns, _LARGEST_NS), "stop": min(until_ns + 1, _LARGEST_NS)}
