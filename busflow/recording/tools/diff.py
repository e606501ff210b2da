"""`BagDiff`: in which messages two recordings differ, topic by topic in the order in which they were published."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field
from itertools import islice, zip_longest
from typing import TYPE_CHECKING

from busflow.errors import BagError, MalformedMessage
from busflow.recording.tools.message_diff import Comparison, FieldDifference
from busflow.recording.tools.pairs import LetGo, Pairs, Side

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel, Entry

_MOST_FIELDS = 8
"""Differences within a message that are kept."""
_SIDES: tuple[Side, Side] = (0, 1)


@dataclass(frozen=True, slots=True)
class MessageDifference:
    """Two messages that are not the same."""

    number: int
    """The number of the message on its topic, from 1."""
    left_ns: int
    """The time of recording, since the beginning of the recording."""
    right_ns: int
    fields: tuple[FieldDifference, ...]


@dataclass(slots=True)
class TopicDifference:
    """A topic of either recording, and how far it is the same in both."""

    topic: str
    left_type: str | None
    """None where the recording does not have the topic."""
    right_type: str | None
    left: int = 0
    """Messages of it."""
    right: int = 0
    different: int = 0
    """Pairs of messages that differ."""
    first: list[MessageDifference] = field(default_factory=list[MessageDifference])

    @property
    def same(self) -> bool:
        """True if nothing of the topic differs."""
        return self.left_type == self.right_type and self.left == self.right and not self.different


@dataclass(frozen=True, slots=True)
class BagDiff:
    """The result of a comparison."""

    topics: tuple[TopicDifference, ...]
    """Sorted by name."""

    @property
    def same(self) -> bool:
        """True if the recordings do not differ."""
        return all(each.same for each in self.topics)

    @property
    def messages(self) -> int:
        """The pairs of messages that were compared."""
        return sum(min(each.left, each.right) for each in self.topics)


def diff(
    left: Bag,
    right: Bag,
    comparison: Comparison,
    topics: Collection[str] | None = None,
    *,
    times: bool = False,
    most: int = 3,
    on_message: Callable[[], None] = lambda: None,
) -> BagDiff:
    """Compare the messages of two recordings: of each topic the first with the first, and so on.

    Args:
        left: One of them.
        right: The other.
        comparison: What still counts as the same.
        topics: Only these.
        times: Whether the times at which messages were recorded have to be the same, too.
        most: How many differing messages of a topic are kept.
        on_message: Is called after each.

    Raises:
        BagError: They have their messages in so different orders that too many would have to be kept.
    """
    found = _Found(left, right, comparison, times=times, most=most)
    entries = left.entries(topics), right.entries(topics)
    for pair in zip_longest(*entries):
        for side, entry in zip(_SIDES, pair, strict=True):
            if entry is not None:
                found.take(side, entry)
                on_message()
    for side in _SIDES:
        for channel in (left, right)[side].channels:
            if topics is None or channel.topic in topics:
                found.declare(side, channel)
    return BagDiff(tuple(sorted(found.topics.values(), key=lambda each: each.topic)))


class _Found:
    """The account of the messages so far."""

    def __init__(self, left: Bag, right: Bag, comparison: Comparison, *, times: bool, most: int) -> None:
        self.topics: dict[str, TopicDifference] = {}
        self._comparison, self._times, self._most = comparison, times, most
        self._starts: list[int | None] = [None, None]
        self._bags = left, right
        self._pairs = Pairs["Entry"]()

    def declare(self, side: Side, channel: Channel) -> TopicDifference:
        """Record a topic, and the type that it has on one side."""
        topic = self.topics.get(channel.topic)
        if topic is None:
            topic = self.topics[channel.topic] = TopicDifference(channel.topic, None, None)
        if side == 0 and topic.left_type is None:
            topic.left_type = channel.type_name
        elif side == 1 and topic.right_type is None:
            topic.right_type = channel.type_name
        return topic

    def take(self, side: Side, entry: Entry) -> None:
        """Compare a message with its counterpart, or let it wait."""
        topic = self.declare(side, entry.channel)
        if self._starts[side] is None:
            self._starts[side] = entry.log_time_ns
        if side == 0:
            topic.left += 1
        else:
            topic.right += 1
        try:
            other = self._pairs.take(entry.channel.topic, side, entry)
        except LetGo:
            names = " and ".join(str(bag.path) for bag in self._bags)
            reason = f"{names} have their messages in too different orders"
            fix = f"compare a few topics at a time, with --topics {entry.channel.topic}"
            raise BagError(reason, fix=fix) from None
        if other is not None:
            pair = (entry, other) if side == 0 else (other, entry)
            self._compare(topic, min(topic.left, topic.right), *pair)

    def _compare(self, topic: TopicDifference, number: int, left: Entry, right: Entry) -> None:
        found = tuple(islice(self._differences(left, right), _MOST_FIELDS))
        if found:
            topic.different += 1
            if len(topic.first) < self._most:
                topic.first.append(MessageDifference(number, self._since(0, left), self._since(1, right), found))

    def _differences(self, left: Entry, right: Entry) -> Iterator[FieldDifference]:
        if self._times and left.log_time_ns != right.log_time_ns:
            yield FieldDifference("log time", left.log_time_ns, right.log_time_ns)
        one, other = left.channel, right.channel
        if one.type_name == other.type_name and left.payload == right.payload:
            return
        try:
            plain = one.plain(left.payload), other.plain(right.payload)
        except (BagError, MalformedMessage):  # what cannot be read is compared as bytes
            yield FieldDifference("", f"{len(left.payload)} bytes", f"{len(right.payload)} bytes, others")
            return
        yield from self._comparison.differences(*plain)

    def _since(self, side: int, entry: Entry) -> int:
        return entry.log_time_ns - (self._starts[side] or 0)
