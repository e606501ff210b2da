"""History: the last messages of each topic, kept by reference so that `--last` finds them, also on volatile topics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, cast

from busflow.bus.expiry import Perishable

if TYPE_CHECKING:
    from busflow.bus.bus import Bus
    from busflow.bus.topic import Topic
    from busflow.interfaces.message import Message

DEFAULT_DEPTH = 1


class KeptMessages:
    """Keeps the last message of every topic, more where a launch file's `history:` says so."""

    def __init__(self, bus: Bus, depths: Mapping[str, int]) -> None:
        """A history that costs one append of a deque per publish; `depths` by final topic name."""
        self._bus, self._depths = bus, depths

    def follow(self, topic: Topic[Any]) -> None:
        """Keep what is published on a topic from now on; once is enough."""
        if topic.recent is None:
            self._bus.keep_recent(topic, self.depth(topic.name))

    def depth(self, topic: str) -> int:
        """How many messages of a topic are kept."""
        return self._depths.get(topic, DEFAULT_DEPTH)

    def last(self, topic: Topic[Any], count: int) -> list[Message]:
        """Up to `count` messages, the oldest first, also those that expired meanwhile."""
        kept = tuple(topic.recent or ())[-count:] if count > 0 else ()
        return [cast("Perishable[Message]", item).message if isinstance(item, Perishable) else item for item in kept]

    def close(self) -> None:
        """Keep nothing more."""
        for topic in self._bus.topics.values():
            self._bus.keep_recent(topic, 0)
