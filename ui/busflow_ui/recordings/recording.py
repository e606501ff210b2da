"""Recording: the topics of a recording under numbers, and its messages at and from a moment. Blocks while it reads."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Generator, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from busflow.clock import NS_PER_S
from busflow.commands import is_hidden
from busflow.errors import BagError, InvalidInput, Problem
from busflow.text import printable

if TYPE_CHECKING:
    from pathlib import Path

    from busflow.commands import Bag, Channel, Entry

_FIRST_NS = 250_000_000
"""How far before a moment the last message of a topic is looked for first; then four times as far, and so on."""
_FURTHER = 4
_RATED_NS = 1_500_000_000
"""How far before and after a moment messages are counted for the rates at it."""
_TRANSFORMS, _FIXED_TRANSFORMS = "/tf", "/tf_static"
_TRANSFORMS_NS = 1_000_000_000
"""How far before a moment transforms are shown: a message has those of one node, and a frame is published often."""
_STATUS, _FEEDBACK = "/_action/status", "/_action/feedback"


@dataclass(frozen=True, slots=True)
class RecordedTopic:
    """Topic of a recording that is offered to pages."""

    id: int
    channel: Channel
    first_ns: int
    last_ns: int

    def announcement(self) -> dict[str, Any]:
        """Return the announcement of this topic, in the protocol's words."""
        channel, definition = self.channel, {"schemaEncoding": "", "schema": ""}
        if channel.definition:
            definition = {"schemaEncoding": channel.definition_encoding, "schema": channel.definition}
        elif channel.fault is None:  # the bag only names the type, and busflow knows it
            definition = {"schemaEncoding": channel.type.definition_encoding, "schema": channel.type.definition}
        head = {"id": self.id, "topic": channel.topic, "schemaName": channel.type_name, "encoding": channel.encoding}
        return head | definition


class Recording:
    """Recording that is shown. It is read by one thread at a time."""

    def __init__(self, bag: Bag) -> None:
        """Read the topics of a bag, and its times.

        Raises:
            InvalidInput: It holds no message.
        """
        self.name: str = bag.path.stem
        self.path: Path = bag.path
        self._bag = bag
        start_ns, end_ns = bag.start_ns, bag.end_ns
        if start_ns is None or end_ns is None:
            damage = "".join(f": {each}" for each in bag.incomplete)
            message = f"{printable(bag.path)} holds no message{damage}"
            raise InvalidInput(Problem("empty", message, "record something first"))
        self.start_ns: int = start_ns
        self.end_ns: int = end_ns
        spans = bag.spans()
        shown = [each for each in bag.channels if each.count and is_offered(each.topic)]
        self.topics: Mapping[int, RecordedTopic] = {
            id_: RecordedTopic(id_, channel, *spans.get(channel, (start_ns, end_ns)))
            for id_, channel in enumerate(shown, 1)
        }
        self._ids = {each.channel: each.id for each in self.topics.values()}
        self._is_indexed = bool(spans)

    def close(self) -> None:
        """Close the recording."""
        self._bag.close()

    def from_(self, moment_ns: int, topics: Collection[int]) -> Generator[tuple[int, Entry]]:
        """Yield each message of these topics from a moment on, with its topic's number; close it after use."""
        entries = self._bag.entries(self._chosen(topics), moment_ns, self.end_ns)
        try:
            for entry in entries:
                yield self._ids[entry.channel], entry
        finally:
            entries.close()

    def shown_at(self, moment_ns: int, topics: Collection[int]) -> list[tuple[int, Entry]]:
        """Return what these topics show at a moment, oldest first: the last message of each, and of frames more."""
        frames = {each: {id_ for id_ in topics if self._name(id_) == each} for each in (_TRANSFORMS, _FIXED_TRANSFORMS)}
        found = list(self.between(self.start_ns, moment_ns, frames[_FIXED_TRANSFORMS]))
        found += self.between(moment_ns - _TRANSFORMS_NS, moment_ns, frames[_TRANSFORMS])
        found += self.at(moment_ns, set(topics) - {id_ for id_, _ in found}).items()
        return sorted(found, key=lambda each: each[1].log_time_ns)

    def at(self, moment_ns: int, topics: Collection[int]) -> dict[int, Entry]:
        """Return the last message of each of these topics at a moment; none of a topic that begins later."""
        found: dict[int, Entry] = {}
        wanted = {id_ for id_ in topics if id_ in self.topics and self.topics[id_].first_ns <= moment_ns}
        for since_ns, until_ns in self.stretches(moment_ns):
            if not wanted:
                break
            newly = dict(self.between(since_ns, until_ns, wanted))
            found |= newly
            wanted -= newly.keys()
        return found

    def stretches(self, moment_ns: int) -> Iterator[tuple[int, int]]:
        """Yield the stretches of time before a moment, each longer than the one after it, back to the beginning."""
        back_ns, until_ns = _FIRST_NS, min(moment_ns, self.end_ns)
        while until_ns >= self.start_ns:
            since_ns = max(self.start_ns, until_ns - back_ns)
            yield since_ns, until_ns
            until_ns, back_ns = since_ns - 1, back_ns * _FURTHER

    def rates_hz(self, moment_ns: int) -> Mapping[int, float]:
        """Return each topic's rate around a moment, by its number; none where the whole bag would have to be read."""
        if not self._is_indexed:
            return {}
        since_ns, until_ns = max(self.start_ns, moment_ns - _RATED_NS), min(self.end_ns, moment_ns + _RATED_NS)
        counts = Counter(id_ for id_, _ in self.between(since_ns, until_ns, self.topics))
        length_s = (until_ns - since_ns) / NS_PER_S
        return {id_: round(counts[id_] / length_s, 3) for id_ in self.topics} if length_s else {}

    def between(self, since_ns: int, until_ns: int, topics: Collection[int]) -> Iterator[tuple[int, Entry]]:
        """Yield each message of these topics within a stretch of time, with its topic's number."""
        for entry in self._bag.entries(self._chosen(topics), since_ns, until_ns):
            yield self._ids[entry.channel], entry

    def _name(self, id_: int) -> str:
        return self.topics[id_].channel.topic if id_ in self.topics else ""

    def _chosen(self, topics: Collection[int]) -> Callable[[Channel], bool]:
        return {self.topics[id_].channel for id_ in topics if id_ in self.topics}.__contains__


def opened(path: Path) -> Recording:
    """Open a recording.

    Raises:
        BagError: It is none, or cannot be read.
        InvalidInput: It holds no message.
    """
    from busflow.commands import Bag

    bag = Bag(path)
    try:
        return Recording(bag)
    except (BagError, InvalidInput):
        bag.close()
        raise


def is_offered(name: str) -> bool:
    """Return whether a topic is offered to pages: of hidden ones the states and the feedback of an action's goals.

    >>> [is_offered(name) for name in ("/imu", "/_imu", "/arm/move/_action/status", "/_arm/move/_action/status")]
    [True, False, True, False]
    """
    return not is_hidden(name.removesuffix(_STATUS).removesuffix(_FEEDBACK))
