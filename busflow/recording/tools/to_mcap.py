"""MCAP: the messages of a bag in one file, with what busflow has written beside them; alone, or as a bag of rosbag2."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import IO, TYPE_CHECKING

from mcap.writer import Writer

from busflow.errors import BagError, MalformedMessage
from busflow.recording.bag.bag_file import Survey
from busflow.recording.bag.facts import FACTS, LAUNCH_FILE, LEDGER, PART, joined, part_of
from busflow.recording.bag.offered_qos import offered, offered_qos_profiles
from busflow.recording.bag.rosbag2_metadata import FileCounts, write_metadata
from busflow.recording.mcap.writer import CHUNK_BYTES
from busflow.recording.recorder.provenance import library

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel, Entry


class McapCopy:
    """Writes an MCAP file."""

    def __init__(
        self,
        stream: IO[bytes],
        bag: Bag,
        channels: Iterable[Channel],
        part: Mapping[str, str],
        *,
        qos: Callable[[Channel], str] = lambda channel: channel.qos or "",
    ) -> None:
        """Begin a file.

        Args:
            stream: What is written to, and closed in the end.
            bag: Whose facts go with the messages.
            channels: Those whose messages will come; one may have none.
            part: The metadata of a part of a recording; empty for a whole one.
            qos: What is written of a channel's offered QoS.
        """
        self._writer = Writer(stream, chunk_size=CHUNK_BYTES, enable_data_crcs=True)
        self._writer.start("ros2", library())
        self._bag, self._is_cut, self._recorded = bag, part_of(part).cut is not None, 0
        self._stream, self._qos = stream, qos
        self._channels: dict[Channel, int] = {}
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        for file in bag.files[:1]:
            if FACTS in file.metadata:  # which of several processes recorded it is true of no message of another
                facts = {name: text for name, text in file.metadata[FACTS].items() if name != "process"}
                if facts != file.metadata[FACTS]:  # whose own counts are not those of the run
                    facts["heard"] = "by each process"
                self._writer.add_metadata(FACTS, facts)
            if file.launch_file is not None:
                self._writer.add_attachment(0, 0, LAUNCH_FILE, "application/yaml", file.launch_file.encode())
        if part:
            self._writer.add_metadata(PART, dict(part))
        for channel in channels:
            self._channels[channel] = self._declare(channel)

    def write(self, entry: Entry) -> None:
        """Write a message."""
        number = self._channels[entry.channel]
        self._writer.add_message(number, entry.log_time_ns, entry.payload, entry.publish_time_ns, entry.sequence)
        self._recorded += entry.sequence > 0  # a repeat has none

    def close(self) -> None:
        """Write the ledger and the summary."""
        bag = self._bag
        words = [file.metadata[LEDGER] for file in bag.files if LEDGER in file.metadata]
        ledger = dict(joined(words)) if bag.ledger is not None else {}
        if len(bag.series) > 1:
            ledger = _of_all(bag)
        if len(bag.files) > 1 or self._is_cut:
            ledger.pop("continued", None)
        if self._is_cut and ledger:
            ledger["recorded"] = str(self._recorded)
        cut_off = bag.damage is not None or any(each.unfinished for each in bag.files)
        unlike = ledger and not bag.complete and (bag.unfinished is not None or ledger.get("complete") == "true")
        if cut_off or unlike:
            ledger |= {"complete": "false", "recovered": ledger.get("recovered") or "; ".join(bag.incomplete)}
        if ledger:
            self._writer.add_metadata(LEDGER, ledger)
        self._writer.finish()
        self._stream.close()

    def _declare(self, channel: Channel) -> int:
        schema = channel.type_name, *_definition(channel)
        if schema not in self._schemas:
            self._schemas[schema] = self._writer.register_schema(*schema)
        metadata = {"offered_qos_profiles": self._qos(channel), "topic_type_hash": channel.type_hash or ""}
        metadata |= {"callerid": channel.publishers} if channel.publishers else {}
        return self._writer.register_channel(channel.topic, channel.encoding, self._schemas[schema], metadata)


def _of_all(bag: Bag) -> dict[str, str]:
    """Return the ledger of a complete recording of several processes."""
    ledger = bag.ledger
    words = {"report": json.dumps(dict(bag.report)), "missed": str(ledger.missed if ledger else 0)}
    if ledger is not None and ledger.recorded is not None:
        words["recorded"] = str(ledger.recorded + sum(each.repeated[0] for each in bag.series))
    return {**words, "complete": "true"}


def _definition(channel: Channel) -> tuple[str, bytes]:
    """Return the encoding and text of a type's definition: busflow's own where the bag only names the type."""
    if channel.definition or channel.fault is not None:
        return channel.definition_encoding, channel.definition.encode()
    return channel.type.definition_encoding, channel.type.definition.encode()


class Rosbag2Directory:
    """Writes a directory that `ros2 bag` reads."""

    def __init__(
        self, directory: Path, name: str, bag: Bag, channels: Iterable[Channel], part: Mapping[str, str]
    ) -> None:
        """Begin a bag of this name in a directory that is there."""
        self._directory, self._file = directory, f"{name}_0.mcap"
        self._counts: Counter[Channel] = Counter({each: 0 for each in channels if each.encoding == "cdr"})
        # Readers match a topic of the file with one of the metadata only if both offer the same.
        stream = (directory / self._file).open("wb")
        self._copy = McapCopy(stream, bag, self._counts, part, qos=_profiles)
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
        write_metadata(self._directory, [FileCounts(self._file, Survey(self._counts, *times))], qos=_profiles)


def _profiles(channel: Channel) -> str:
    """Return the offered QoS in this version's words, whatever version the bag has."""
    try:
        found = offered(channel.qos)
    except BagError:  # no reader could have used it either
        found = None
    return "" if found is None else offered_qos_profiles([found])
