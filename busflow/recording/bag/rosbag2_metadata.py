"""The `metadata.yaml` of a directory of rosbag2, by which ROS 2's programs find their way in its files."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import yaml

from busflow.errors import BagError
from busflow.recording.bag.bag import Bag
from busflow.recording.bag.bag_file import Survey
from busflow.recording.bag.rosbag2 import INFORMATION, LACKING, METADATA
from busflow.recording.bag.series import Series

if TYPE_CHECKING:
    from busflow.recording.bag.channel import Channel

_VERSION = 9
"""The version of the metadata, that of ROS 2 Jazzy."""
_SERVICE, _EVENT = "/srv/", "_Event"
_LAST_NS = (1 << 63) - 1


@dataclass(frozen=True, slots=True)
class FileCounts:
    """The contents of one file of a directory."""

    name: str
    found: Survey


def file_counts(series: Iterable[Series]) -> list[FileCounts]:
    """Return the contents of each file, as far as ROS 2 can read them; one without an end is read as a whole."""
    found: list[FileCounts] = []
    for file in (file for each in series for file in each.files):
        contents = file.overview() or Series([file], str(file.path)).survey()
        counts = {channel: count for channel, count in contents.counts.items() if channel.encoding == "cdr"}
        found.append(FileCounts(file.path.name, replace(contents, counts=counts)))
    return found


def describe_recordings(directory: Path, *, lacking: str = "") -> None:
    """Write the `metadata.yaml` for busflow's own recordings in a directory.

    Args:
        directory: Where they are.
        lacking: Losses that no file shows, in words, e.g. the last moments of a killed process.

    Raises:
        BagError: One of them cannot be read.
        OSError: It cannot be written.
    """
    with Bag(directory) as bag:
        custom = {LACKING: lacking} if lacking else None
        write_metadata(directory, file_counts(bag.series), qos=lambda channel: channel.qos or "", custom=custom)


def write_metadata(
    directory: Path,
    files: Sequence[FileCounts],
    *,
    qos: Callable[[Channel], str],
    custom: Mapping[str, str] | None = None,
) -> None:
    """Write the `metadata.yaml` of a directory, all at once.

    Args:
        directory: Where the files are.
        files: All of them, in their order.
        qos: What each channel offers, in the words of this version of the metadata.
        custom: Entries that are not ROS 2's.

    Raises:
        BagError: It cannot be written.
    """
    whole = Survey.of([each.found for each in files])
    information = {
        "version": _VERSION,
        "storage_identifier": "mcap",
        **_span(whole),
        "topics_with_message_count": [_topic(each, count, qos(each)) for each, count in whole.counts.items()],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [each.name for each in files],
        "files": [{"path": each.name, **_span(each.found)} for each in files],
        "custom_data": dict(custom) if custom else None,
        "ros_distro": "busflow",
    }
    text = yaml.safe_dump({INFORMATION: information}, sort_keys=False)
    part = directory / f".{METADATA}.part"
    try:
        part.write_text(text, "utf-8")
        part.replace(directory / METADATA)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise BagError(f"{METADATA} cannot be written: {error.strerror}") from None


def _span(found: Survey) -> dict[str, Any]:
    """Return the time span of the messages, and their number."""
    first = _LAST_NS if found.start_ns is None else found.start_ns
    return {
        "duration": {"nanoseconds": 0 if found.end_ns is None else max(0, found.end_ns - first)},
        "starting_time": {"nanoseconds_since_epoch": first},
        "message_count": found.messages,
    }


def _topic(channel: Channel, count: int, qos: str) -> Mapping[str, Any]:
    # rosbags knows no events of services, and would open nothing for want of their hash.
    service = channel.type_name.endswith(_EVENT) and _SERVICE in channel.type_name
    return {
        "topic_metadata": {
            "name": channel.topic,
            "type": channel.type_name,
            "serialization_format": channel.encoding,
            "offered_qos_profiles": yaml.safe_load(qos or "[]"),
            "type_description_hash": "" if service else channel.type_hash or channel.type.type_hash,
        },
        "message_count": count,
    }
