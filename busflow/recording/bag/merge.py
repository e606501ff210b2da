"""Merge: the messages of several series as one: by log time, each series in its own order, ties by the order of series.

The processes of a run read the same clock of the same machine, which is all that is known of their order.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence

from busflow.recording.bag.channel import Entry

Numbered = tuple[int, Entry]
"""A message, and the number of its series."""


def merged(series: Sequence[Iterable[Entry]]) -> Iterator[Numbered]:
    """All messages, the earliest first.

    Where a series' own clock was set back, what it recorded then comes at once: its order is never changed.
    """
    lanes = [_numbered(number, each) for number, each in enumerate(series)]
    return heapq.merge(*lanes, key=lambda found: found[1].log_time_ns)


def renumbered(found: Iterable[Numbered]) -> Iterator[Entry]:
    """The messages with numbers over all of them; what is missing in a series leaves as large a gap."""
    last: dict[int, int] = {}
    number = 0
    for series, entry in found:
        number += max(1, entry.sequence - last.get(series, 0))
        last[series] = entry.sequence
        yield entry._replace(sequence=number)


def _numbered(number: int, entries: Iterable[Entry]) -> Iterator[Numbered]:
    return ((number, entry) for entry in entries)
