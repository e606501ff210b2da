"""Recording files: what a spool writes to. One MCAP file, or with `split` one part after the other, each of them whole.

Every part begins with what a reader of this part alone needs: the facts of the run, all types and topics so far, and
the newest messages of transient_local publishers. These repeats have the number 0, which no other message has.
"""

from __future__ import annotations

import json
from collections import Counter, deque
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

from busflow.recording.bag.facts import NONE_LATER, PART
from busflow.recording.mcap.writer import McapWriter, Payload
from busflow.recording.recorder.destination import Destination, new_recording
from busflow.recording.recorder.provenance import MetadataRecord, facts, launch_files, ledger, library

if TYPE_CHECKING:
    from busflow.bus.qos import QoS
    from busflow.launchfile.model.description import Compression, RecordSpec, Split
    from busflow.runner.graph import Graph

MOST_PARTS = 10_000
"""The number of parts after which the last one only grows: readers limit the list of files."""

REPEATED = 0
"""The number of a message that an earlier part has."""


class MakeFile(Protocol):
    """A function that makes a file of a recording: `path`, and `more` metadata beside the facts of the run."""

    def __call__(self, path: Path, *more: MetadataRecord) -> tuple[Destination, McapWriter]:
        """Make the file and write its beginning; in any thread.

        Raises:
            RecordingRefused: it is there already, or cannot be made.
        """
        ...


class RecordingFile:
    """One MCAP file that is being written, with its place on the disk."""

    def __init__(self, destination: Destination, writer: McapWriter) -> None:
        self._destination, self._writer = destination, writer

    @property
    def path(self) -> Path:
        """The file."""
        return self._destination.path

    @property
    def written(self) -> int:
        """The number of messages that are in it for certain."""
        return self._writer.written

    @property
    def open_chunk(self) -> bool:
        """True if messages wait in a chunk that is not in the file yet."""
        return self._writer.open_chunk

    @property
    def open_since(self) -> int:
        """The time of the first message in the chunk that is not in the file yet."""
        return self._writer.open_since

    def add_schema(self, schema_id: int, name: str, encoding: str, data: bytes) -> None:
        """Describe a type."""
        self._writer.add_schema(schema_id, name, encoding, data)

    def add_channel(
        self, channel_id: int, topic: str, encoding: str, schema_id: int, metadata: Mapping[str, str]
    ) -> None:
        """Announce a topic of a type that is described."""
        self._writer.add_channel(channel_id, topic, encoding, schema_id, metadata)

    def add_message(self, channel_id: int, sequence: int, time_ns: int, payload: Payload) -> None:
        """Write a message."""
        self._writer.add_message(channel_id, sequence, time_ns, payload)

    def repeat(self, messages: Iterable[tuple[int, int, Payload]], time_ns: int) -> None:
        """Write earlier messages at this time: each with its channel, the time of its publishing, and its bytes."""
        for channel_id, published_ns, payload in messages:
            self._writer.add_message(channel_id, REPEATED, time_ns, payload, published_ns=published_ns)

    def add_latched(self, message: Latched) -> None:
        """Remember a message that was written, and that a late joiner would get."""

    def cut(self) -> None:
        """Hand what waits to the operating system."""
        self._writer.cut()

    def conclude(
        self,
        report: Mapping[str, Any],
        recorded: int,
        missed: int,
        later: Mapping[str, Sequence[str]] = NONE_LATER,
        *,
        lacking: str = "",
    ) -> None:
        """Write the account of the run, as `ledger` takes it, and the summary: nothing may follow."""
        counts = self._of_this_file(recorded, missed)
        self._writer.add_metadata(*ledger(report, *counts, later, lacking=lacking))
        self._writer.finish()

    def _of_this_file(self, recorded: int, missed: int) -> tuple[int, int]:
        """Return how many of the recorded and of the missed messages belong to this file."""
        return recorded, missed

    def cut_off(self) -> None:
        """Cut off what was written in part."""
        self._writer.cut_off(self._destination.cut_off(self._writer.size))

    def secure(self) -> None:
        """Make sure that what was written survives a loss of power.

        Raises:
            OSError: as `Destination.secure`.
        """
        self._destination.secure()

    def close(self) -> None:
        """Write no more."""
        self._writer.close()
        self._destination.close()


def graph_file_maker(graph: Graph, spec: RecordSpec, process: str = "") -> MakeFile:
    """Return a function that makes the files of a graph's recording, with the facts as they are now."""
    now_ns = graph.clock.now_ns()
    run = facts(graph.name, graph.seed, graph.clock.kind, now_ns, process)
    return file_maker(run, spec.compression, tuple(launch_files(graph.descriptions)), attached_ns=now_ns)


def file_maker(
    run: MetadataRecord, compression: Compression, attachments: Sequence[tuple[str, str]] = (), *, attached_ns: int = 0
) -> MakeFile:
    """Return a function that makes the files of a recording.

    Args:
        run: the facts of the run.
        compression: of the files' chunks.
        attachments: the launch files of the run, each with its name and its text.
        attached_ns: the time of the attachments.
    """

    def make(path: Path, *more: MetadataRecord) -> tuple[Destination, McapWriter]:
        with new_recording(path) as destination, ExitStack() as begun:
            writer = McapWriter(destination, library=library(), compression=compression, folder=path.parent)
            begun.callback(writer.close)
            for each in (*more, run):
                writer.add_metadata(*each)
            for name, text in attachments:
                writer.add_attachment(name, "application/yaml", text.encode(), time_ns=attached_ns)
            begun.pop_all()
        return destination, writer

    return make


class LatchingPublisher(Protocol):
    """A transient_local publisher; equal ones are the same."""

    @property
    def qos(self) -> QoS:
        """What it offers."""
        ...


@dataclass(frozen=True, slots=True)
class Latched:
    """A message of a transient_local publisher."""

    publisher: LatchingPublisher
    channel_id: int
    sequence: int
    time_ns: int
    payload: Payload


class SplitFile(RecordingFile):
    """Writes a recording in parts; a message that does not fit into one begins the next."""

    def __init__(self, path: Path, split: Split, make_file: MakeFile, *, durable: bool) -> None:
        """Begin the first part.

        Args:
            path: the name of a file; each part has it with its number, `run_0.mcap`.
            split: when a part ends.
            make_file: makes a part's file, and writes the facts of the run and the metadata of the part to it.
            durable: whether each part survives a loss of power once it has ended.

        Raises:
            RecordingRefused: its file is there already, or cannot be made.
        """
        self._named, self._split, self._make_file, self._durable = path, split, make_file, durable
        self._number, self._first = 0, 1
        self._first_ns: int | None = None
        self._recorded_before = self._missed_before = 0
        """The messages of the parts that have ended."""
        self._repeated = self._head_size = 0
        """The messages that an earlier part has, and the size of all that stands before new ones."""
        self._schemas: dict[int, tuple[int, str, str, bytes]] = {}
        self._channels: dict[int, tuple[int, str, str, int, Mapping[str, str]]] = {}
        self._latched: dict[LatchingPublisher, deque[Latched]] = {}
        super().__init__(*make_file(self._path(0), part_metadata(0, 1, {})))

    @property
    def written(self) -> int:
        """The number of messages that are in all parts for certain, each counted once."""
        return self._recorded_before + max(0, super().written - self._repeated)

    def add_schema(self, schema_id: int, name: str, encoding: str, data: bytes) -> None:
        """Describe a type, in each part from now on."""
        self._schemas[schema_id] = (schema_id, name, encoding, data)
        super().add_schema(schema_id, name, encoding, data)

    def add_channel(
        self, channel_id: int, topic: str, encoding: str, schema_id: int, metadata: Mapping[str, str]
    ) -> None:
        """Announce a topic, in each part from now on."""
        self._channels[channel_id] = (channel_id, topic, encoding, schema_id, metadata)
        super().add_channel(channel_id, topic, encoding, schema_id, metadata)

    def add_message(self, channel_id: int, sequence: int, time_ns: int, payload: Payload) -> None:
        """Write a message, to the next part if this one is full."""
        if self._first_ns is None:
            self._first_ns = time_ns
        elif self._is_full(time_ns) and self._number + 1 < MOST_PARTS:
            self._go_on(sequence, time_ns)
        super().add_message(channel_id, sequence, time_ns, payload)

    def add_latched(self, message: Latched) -> None:
        """Repeat a message in each later part, until its publisher has published more than it keeps."""
        depth = message.publisher.qos.depth
        self._latched.setdefault(message.publisher, deque(maxlen=depth)).append(message)

    def _of_this_file(self, recorded: int, missed: int) -> tuple[int, int]:
        return recorded - self._recorded_before, missed - self._missed_before

    def _is_full(self, time_ns: int) -> bool:
        size, duration_s, first_ns = self._split.size, self._split.duration_s, self._first_ns or 0
        # Repeats do not count: a map that is larger than a part would otherwise begin a part for each message.
        by_size = size is not None and self._writer.size - self._head_size >= size
        return by_size or (duration_s is not None and time_ns - first_ns >= round(duration_s * 1e9))

    def _go_on(self, sequence: int, time_ns: int) -> None:
        """End this part, and begin the next with the message of this number and time."""
        recorded = self._writer.messages - self._repeated
        missed = sequence - self._first - recorded
        name, account = ledger({}, recorded, missed)
        self._writer.add_metadata(name, {**account, "continued": "true"})
        self._writer.finish()
        if self._durable:
            self._destination.secure()
        self.close()
        latched = sorted((each for kept in self._latched.values() for each in kept), key=attrgetter("sequence"))
        counts = Counter(self._channels[each.channel_id][1] for each in latched)
        number = self._number + 1
        self._destination, self._writer = self._make_file(self._path(number), part_metadata(number, sequence, counts))
        self._number, self._first, self._first_ns = number, sequence, time_ns
        self._recorded_before += recorded
        self._missed_before += missed
        self._repeated = len(latched)
        self._write_head(latched, time_ns)

    def _write_head(self, latched: Sequence[Latched], time_ns: int) -> None:
        """Write the types, topics and latched messages of earlier parts, which a reader of this part alone needs."""
        for schema in self._schemas.values():
            self._writer.add_schema(*schema)
        for channel in self._channels.values():
            self._writer.add_channel(*channel)
        self.repeat(((each.channel_id, each.time_ns, each.payload) for each in latched), time_ns)
        self._writer.cut()
        self._head_size = self._writer.size

    def _path(self, number: int) -> Path:
        return self._named.with_stem(f"{self._named.stem}_{number}")


def part_metadata(number: int, first: int, repeated: Mapping[str, int], *, reason: str = "") -> MetadataRecord:
    """Return the metadata of a part, as `BagPart` has it."""
    place = {"number": str(number), "first": str(first)}
    place |= {"repeated": json.dumps(repeated)} if repeated else {}
    return PART, place | ({"reason": reason} if reason else {})
