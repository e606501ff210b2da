"""Overview: one number of a topic over a stretch of a recording, thinned to the least and greatest of each bin."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

from busflow.clock import NS_PER_S
from busflow.errors import BagError, MalformedMessage, NoSuchTarget
from busflow.text import printable

if TYPE_CHECKING:
    from busflow_ui.recordings.recording import Recording

MOST_BINS = 4000
_MOST_READ = 100_000
"""Most messages that are decoded for one answer; of more, evenly spread ones."""
_MOST_STEPS = 32
_NAMES = ("name", "names", "joint_names")
_OWN_NAMES = ("name", "child_frame_id")
_SAME_CLOCK_NS = 600 * NS_PER_S
"""A header's stamp further from the moment of recording than this is of another clock, as on the page."""


@dataclass(frozen=True, slots=True)
class Named:
    """Item of an array by the name that stands beside it, or the value of an odd key."""

    name: str


Path = Sequence[str | int | Named]


@dataclass(frozen=True, slots=True)
class Stretch:
    """Stretch of a recording in so many bins."""

    start_ns: int
    end_ns: int
    bins: int


def path_of(steps: object) -> Path:
    """Return a path as the page writes it: texts, whole numbers, and `{named}`.

    Raises:
        MalformedMessage: It is none.
    """
    if not isinstance(steps, list) or not 0 < len(cast("list[object]", steps)) <= _MOST_STEPS:
        raise MalformedMessage(f"path is a list of 1 to {_MOST_STEPS} steps")
    return [_step(each) for each in cast("list[object]", steps)]


def _step(step: object) -> str | int | Named:
    match step:
        case bool():
            pass
        case str() | int():
            return step
        case {"named": str(name)}:
            return Named(name)
        case _:
            pass
    raise MalformedMessage("a step of a path is a field, the number of an item, or {named: its name}")


def overview(recording: Recording, topic: str, path: Path, stretch: Stretch) -> dict[str, Any]:
    """Return the points of a line: `{from_ns, times_s, values, every}`; times from `from_ns` on, a gap is None.

    Blocks while it reads. `every` is above 1 where only each so many messages were read.

    Raises:
        NoSuchTarget: The recording has no such topic, or its messages cannot be read.
    """
    id_ = next((id_ for id_, each in recording.topics.items() if each.channel.topic == topic), None)
    if id_ is None:
        raise NoSuchTarget(f"the recording has no topic {printable(topic, limit=200)}")
    channel = recording.topics[id_].channel
    if channel.fault is not None:
        raise NoSuchTarget(str(channel.fault))
    every = max(1, math.ceil(_expected(recording, channel.count or 0, stretch) / _MOST_READ))
    bins, is_of_item = _Bins(stretch), any(isinstance(step, Named) for step in path)
    reading = recording.from_(stretch.start_ns, {id_})
    try:
        for number, (_, entry) in enumerate(reading):
            if entry.log_time_ns > stretch.end_ns:
                break
            if number % every == 0:
                stamp_ns, value = _point(channel.plain, entry.payload, entry.log_time_ns, path)
                if value is not None or not is_of_item:  # a message without the named item says nothing of it
                    bins.add(stamp_ns, value)
    finally:
        reading.close()
    return {"from_ns": str(stretch.start_ns), "every": every, **bins.points()}


def _expected(recording: Recording, count: int, stretch: Stretch) -> float:
    """Return about how many of a topic's messages are in a stretch."""
    length_ns = max(1, recording.end_ns - recording.start_ns)
    return count * (stretch.end_ns - stretch.start_ns) / length_ns


def _point(decode: Any, payload: bytes, log_time_ns: int, path: Path) -> tuple[int, float | None]:
    """Return stamp and number of a message; None where it has no number there, or cannot be read."""
    try:
        message = decode(payload)
    except (BagError, MalformedMessage):
        return log_time_ns, None
    found = value_at(path, message)
    is_number = isinstance(found, int | float) and math.isfinite(found)
    return _stamp_ns(message, log_time_ns), float(found) if is_number else None


def _stamp_ns(message: Any, log_time_ns: int) -> int:
    """Return the stamp by which the page plots a message: that of its header, unless it is of another clock."""
    match message:
        case {"header": {"stamp": {"sec": int(sec), "nanosec": int(nanosec)}}} if sec or nanosec:
            stamp_ns = sec * NS_PER_S + nanosec
            return stamp_ns if abs(stamp_ns - log_time_ns) <= _SAME_CLOCK_NS else log_time_ns
        case _:
            return log_time_ns


def value_at(path: Path, message: Any) -> Any:
    """Return the value at a path of a message; None where the message has none."""
    ancestors: list[Any] = []
    value = message
    for step in path:
        parent = value
        match step:
            case int():
                value = value[step] if _is_array(value) and -len(value) <= step < len(value) else None
            case Named(name) if _is_array(value):
                value = _item(name, value, ancestors)
            case Named(name) | str(name):
                value = cast("Mapping[str, Any]", value).get(name) if isinstance(value, Mapping) else None
        if value is None:
            return None
        ancestors.append(parent)
    return value


def _item(name: str, items: Sequence[Any], ancestors: Sequence[Any]) -> Any:
    """Return the item of an array whose name stands in an array of names beside or above it."""
    for ancestor in reversed(ancestors):
        for word in _NAMES:
            names = cast("Mapping[str, Any]", ancestor).get(word) if isinstance(ancestor, Mapping) else None
            if isinstance(names, list | tuple) and len(cast("Sequence[Any]", names)) == len(items) and name in names:
                return items[cast("Sequence[Any]", names).index(name)]
    for item in items:
        if isinstance(item, Mapping) and any(cast("Mapping[str, Any]", item).get(word) == name for word in _OWN_NAMES):
            return cast("Mapping[str, Any]", item)
    return None


def _is_array(value: object) -> bool:
    return isinstance(value, list | tuple | memoryview)


class _Bins:
    """Least and greatest number of each bin, with their moments, in the order of their coming."""

    def __init__(self, stretch: Stretch) -> None:
        self._start_ns = stretch.start_ns
        self._per_ns = stretch.bins / max(1, stretch.end_ns - stretch.start_ns)
        self._extremes: dict[int, list[tuple[int, float]]] = {}
        self._last = stretch.bins - 1
        self._gaps: set[int] = set()

    def add(self, stamp_ns: int, value: float | None) -> None:
        """Add a number, or a gap."""
        place = min(self._last, max(0, int((stamp_ns - self._start_ns) * self._per_ns)))
        if value is None:
            self._gaps.add(place)
            return
        known = self._extremes.get(place)
        if known is None:
            self._extremes[place] = [(stamp_ns, value), (stamp_ns, value)]
        elif value < known[0][1]:
            known[0] = (stamp_ns, value)
        elif value > known[1][1]:
            known[1] = (stamp_ns, value)

    def points(self) -> dict[str, list[Any]]:
        """Return the points in the order of their times; a bin with nothing but gaps is one."""
        found: list[tuple[int, float | None]] = []
        for place in sorted(self._extremes.keys() | self._gaps):
            if place in self._extremes:
                found += sorted(set(self._extremes[place]))
            else:
                found.append((self._start_ns + round(place / self._per_ns), None))
        return {
            "times_s": [(stamp_ns - self._start_ns) / NS_PER_S for stamp_ns, _ in found],
            "values": [value for _, value in found],
        }
