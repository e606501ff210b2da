"""Cuts: a part of a recording, by time or by topic, says in its file of which recording it is a part."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING

from busflow.recording.bag.facts import PART, Cut, part_of

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel, Entry


def cut_of(bag: Bag, channels: Collection[Channel], times: tuple[int | None, int | None]) -> Cut | None:
    """Return the part of a bag that has some channels and lies between two log times; None if it is all of the bag."""
    first_ns, last_ns = bag.start_ns or 0, bag.end_ns or 0
    start_ns, end_ns = times
    topics = {each.topic for each in channels}
    without = {each.topic for each in bag.channels if each.count and each.topic not in topics}
    found = Cut(
        bag.path.name,
        None if start_ns is None or start_ns <= first_ns else start_ns - first_ns,
        None if end_ns is None or end_ns >= last_ns else end_ns - first_ns,
        tuple(sorted(without.union(*(each.without for each in bag.cuts[:1])))),
    )
    return found if without or (found.from_ns, found.to_ns) != (None, None) else None


def words_of(bag: Bag, cut: Cut | None, repeats: Sequence[Entry], first: int) -> dict[str, str]:
    """Return the metadata of a part, empty for a whole recording.

    Args:
        bag: The recording.
        cut: The part of it that is written.
        repeats: The messages that come first because publishers kept them.
        first: The number of the first message after them.
    """
    file = bag.files[0]
    stated = file.metadata.get(PART, {}) if len(bag.series) == 1 else {}
    if cut is None:
        return stated if stated and (part_of(stated).begins_later or not bag.series[0].whole) else {}
    words = {"number": "0", **stated, **cut.words}
    if cut.from_ns is not None:
        repeated = Counter(each.channel.topic for each in repeats)
        words |= {"first": str(first), "repeated": json.dumps(repeated)}
    elif "repeated" in words:
        repeated = {name: count for name, count in part_of(stated).repeated.items() if name not in cut.without}
        words["repeated"] = json.dumps(repeated)
    return words
