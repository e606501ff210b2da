"""Answers about a recording: which nodes publish which topics, and how often at a moment; its log."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, Any

from busflow.clock import NS_PER_S
from busflow.commands import is_hidden
from busflow.errors import BagError, MalformedMessage

if TYPE_CHECKING:
    from busflow_ui.recordings.recording import RecordedTopic, Recording

_LOG = "/rosout"


def graph_of(recording: Recording, moment_ns: int) -> dict[str, Any]:
    """Return the graph in the form of a run's, with the rates at a moment. Blocks while it reads.

    A recording knows no subscriptions, and no state of a node.
    """
    topics, rates_hz = recording.topics.values(), recording.rates_hz(moment_ns)
    published: dict[str, list[str]] = {}
    for each in topics:
        for node in each.channel.publisher_names:
            published.setdefault(node, []).append(each.channel.topic)
    return {
        "elapsed_s": (recording.end_ns - recording.start_ns) / NS_PER_S,
        "clock": "",
        "inbox": [],
        "nodes": [_node(name, topics) for name, topics in sorted(published.items())],
        "topics": [_topic(each, rates_hz.get(each.id)) for each in topics],
        "services": [],
    }


def log_of(recording: Recording, moment_ns: int, count: int) -> list[dict[str, Any]]:
    """Return the last lines of the log up to a moment, oldest first, in the form of a run's. Blocks while it reads."""
    ids = [id_ for id_, each in recording.topics.items() if each.channel.topic == _LOG and each.channel.fault is None]
    lines: list[dict[str, Any]] = []
    for stretch in recording.stretches(moment_ns):
        lines = [*_lines(recording, stretch, ids), *lines]
        if len(lines) >= count:
            break
    return lines[-count:]


def _lines(recording: Recording, stretch: tuple[int, int], ids: Collection[int]) -> Iterator[dict[str, Any]]:
    for id_, entry in recording.between(*stretch, ids):
        try:
            found = recording.topics[id_].channel.plain(entry.payload)
            stamp = found["stamp"]["sec"] * NS_PER_S + found["stamp"]["nanosec"]
            yield {"stamp_ns": stamp, "level": found["level"], "node": found["name"], "text": found["msg"]}
        except (BagError, MalformedMessage, KeyError, TypeError):  # another program's type of this name
            continue


def _node(name: str, topics: list[str]) -> dict[str, Any]:
    stated = {"name": name, "namespace": name.rpartition("/")[0] or "/", "state": "recorded", "publishers": topics}
    unknown = dict.fromkeys(("process", "machine", "pid", "plugin", "source"))
    lists = ("failures", "depends_on", "timers", "subscriptions", "services", "clients")
    none: dict[str, list[str]] = {word: [] for word in lists}
    return {**stated, **unknown, **none, "restarts": 0, "stopped_by_hand": 0, "is_busflow": True, "hidden": False}


def _topic(topic: RecordedTopic, rate_hz: float | None) -> dict[str, Any]:
    channel, unknown = topic.channel, dict.fromkeys(("qos", "origin", "published"))
    return {
        "name": channel.topic,
        "type": channel.type_name,
        "hidden": is_hidden(channel.topic),
        "external": False,
        "published": channel.count or 0,
        "rate_hz": rate_hz,
        "publishers": [{"node": each, **unknown} for each in channel.publisher_names],
        "subscriptions": [],
        "losses": {},
    }
