"""Kept messages: what `transient_local` publishers kept for late joiners when a part of a recording begins."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from busflow.recording.bag.offered_qos import kept_depths
from busflow.recording.bag.series import Series

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel, Entry

_MOST_DIFFERENT = 100
"""The most messages that count as kept on a topic with several publishers, if these keep no more."""


def kept(bag: Bag, wanted: Callable[[Channel], bool], at_ns: int) -> list[Entry]:
    """Return the messages that publishers kept at a moment: repeats of that moment, with the number 0.

    A recording does not say which of several publishers has published a message. Each different message then counts as
    kept, at its last place, so that no publisher's newest one is lost.
    """
    return [each for series in bag.series for each in _of_series(series, wanted, at_ns)]


def _of_series(series: Series, wanted: Callable[[Channel], bool], at_ns: int) -> list[Entry]:
    depths: dict[Channel, list[int]] = {}
    found: dict[Channel, dict[object, tuple[int, Entry]]] = {}

    def is_latched(channel: Channel) -> bool:
        depths[channel] = kept_depths(channel.qos) if wanted(channel) else []
        return bool(depths[channel])

    for number, entry in enumerate(series.entries(is_latched, until_ns=at_ns - 1)):
        those, each = depths[entry.channel], found.setdefault(entry.channel, {})
        several = max(len(those), len(entry.channel.publisher_names)) > 1
        key = entry.payload if several else number
        each.pop(key, None)
        each[key] = number, entry
        if len(each) > (max(_MOST_DIFFERENT, sum(those)) if several else those[0]):
            del each[next(iter(each))]
    rows = sorted((row for each in found.values() for row in each.values()), key=lambda row: row[0])
    return [entry._replace(sequence=0, log_time_ns=at_ns) for _, entry in rows]
