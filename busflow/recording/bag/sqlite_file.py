"""`SqliteFile`: one database of a bag, as rosbag2 wrote them before MCAP. It is opened read-only."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection, Generator, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote

from busflow.errors import BagError
from busflow.recording.bag.bag_file import SINCE, UNTIL, Overview
from busflow.recording.bag.channel import Channel, Entry
from busflow.recording.mcap.bounds import LARGEST_RECORD

_MOST_TOPICS = 1 << 16
_CONVERT = "ros2 bag convert writes it as mcap"
_HEAD = 100
"""Bytes of SQLite's header."""
_SEQUENCES = (1 << 32) - 1
"""A number of a message has 32 bits, as in MCAP; after so many it begins anew."""
_LARGEST_NS = (1 << 63) - 1
"""SQLite's integers are of 64 bits with a sign."""


class SqliteFile:
    """A database of a bag."""

    launch_file: str | None = None
    recorder = "rosbag2, sqlite3"

    def __init__(self, path: Path) -> None:
        """Open a database and read its topics.

        Raises:
            BagError: It is none, or not one of rosbag2.
        """
        self.path = path
        self.metadata: dict[str, dict[str, str]] = {}
        try:
            self.size = path.stat().st_size
            self.unfinished = _cut_off(path, self.size)
            with self._opened() as connection:
                self._topics = dict(_topics(connection, str(path)))
        except OSError as error:
            raise BagError(f"it cannot be opened: {error.strerror}", file=str(path)) from None
        except sqlite3.Error as error:
            raise BagError(f"it is no database of rosbag2: {error}", file=str(path), fix=_CONVERT) from None

    @property
    def channels(self) -> Collection[Channel]:
        """Its topics."""
        return self._topics.values()

    def overview(self) -> Overview | None:
        """What the database counts; None where it cannot."""
        try:
            with self._opened() as connection:
                counts = dict(connection.execute("SELECT topic_id, count(*) FROM messages GROUP BY topic_id"))
                first, last = connection.execute("SELECT min(timestamp), max(timestamp) FROM messages").fetchone()
        except sqlite3.Error:
            return None  # whoever reads the messages is told
        return Overview({each: counts.get(number, 0) for number, each in self._topics.items()}, first, last)

    def spans(self) -> Mapping[Channel, tuple[int, int]] | None:
        """When each channel's first and last message was recorded; None where the database cannot tell."""
        try:
            with self._opened() as connection:
                query = "SELECT topic_id, min(timestamp), max(timestamp) FROM messages GROUP BY topic_id"
                times = {number: (first, last) for number, first, last in connection.execute(query)}
        except sqlite3.Error:
            return None
        return {each: times[number] for number, each in self._topics.items() if number in times}

    def walk(self, wanted: Callable[[Channel], bool], since_ns: int = SINCE, until_ns: int = UNTIL) -> Iterator[Entry]:
        """The messages, in the order in which they were written.

        Raises:
            BagError: The database is damaged.
        """
        chosen = {number: channel for number, channel in self._topics.items() if wanted(channel)}
        query = "SELECT id, topic_id, timestamp, data FROM messages WHERE timestamp BETWEEN ? AND ? ORDER BY id"
        try:
            with self._opened() as connection:
                times = (min(since_ns, _LARGEST_NS), min(until_ns, _LARGEST_NS))
                for number, topic, time_ns, data in connection.execute(query, times):
                    if type(data) is not bytes or type(time_ns) is not int:
                        what = f"message {number} is {type(data).__name__} at {time_ns!r}"
                        raise BagError(f"the database is damaged: {what}", file=str(self.path))
                    if topic in chosen:
                        yield Entry(chosen[topic], number & _SEQUENCES, time_ns, time_ns, data)
        except (sqlite3.Error, MemoryError) as error:
            raise BagError(f"the database is damaged: {error}", file=str(self.path)) from None
        if self.unfinished is not None:
            raise self.unfinished

    @contextmanager
    def _opened(self) -> Generator[sqlite3.Connection]:
        # A column may hold a value of any type, whatever it was declared as: who reads one looks.
        # What is immutable is not locked, and SQLite does not look for a journal beside it to play back.
        uri = f"file:{quote(str(self.path.absolute()))}?mode=ro&immutable=1"
        with closing(sqlite3.connect(uri, uri=True)) as connection:
            connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_RECORD)
            connection.execute("PRAGMA trusted_schema = OFF")
            yield connection


def _cut_off(path: Path, size: int) -> BagError | None:
    """What is wrong where a database is shorter than it says; SQLite may take what is missing for empty."""
    with path.open("rb") as stream:
        head = stream.read(_HEAD)
    if len(head) < _HEAD:
        return None  # SQLite refuses it
    unit = int.from_bytes(head[16:18], "big")
    stated = int.from_bytes(head[28:32], "big") * (1 << 16 if unit == 1 else unit)
    if size >= stated or head[24:28] != head[92:96]:  # an old SQLite has not kept the count
        return None
    return BagError(f"it has {size} of the {stated} bytes of the database: it was cut off", file=str(path))


def _topics(connection: sqlite3.Connection, file: str) -> Iterator[tuple[int, Channel]]:
    """The topics by their numbers; what older databases do not tell of them is left out."""
    columns = {row[1] for row in connection.execute("PRAGMA table_info(topics)")}
    definitions: dict[str, tuple[str, str]] = {}
    if connection.execute("PRAGMA table_info(message_definitions)").fetchone():
        rows = connection.execute("SELECT topic_type, encoding, encoded_message_definition FROM message_definitions")
        definitions = {name: (str(encoding), str(text)) for name, encoding, text in rows}
    optional = [name if name in columns else "NULL" for name in ("type_description_hash", "offered_qos_profiles")]
    query = f"SELECT id, name, type, serialization_format, {', '.join(optional)} FROM topics LIMIT {_MOST_TOPICS + 1}"  # noqa: S608  # of these words alone
    for count, (number, *words) in enumerate(connection.execute(query)):
        if count == _MOST_TOPICS:
            raise BagError(f"it has more than {_MOST_TOPICS} topics", file=file)
        topic, type_name, encoding, type_hash, qos = (None if word is None else str(word) for word in words)
        how, text = definitions.get(type_name or "", ("", ""))
        yield number, Channel(topic or "", type_name or "", encoding or "", text, how, type_hash or None, qos or None)
