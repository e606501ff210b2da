"""Kept messages: the last messages of each topic, kept by reference for `--last`, also on volatile topics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from busflow.bus.expiry import message_of

if TYPE_CHECKING:
    from busflow.bus.bus import Bus
    from busflow.bus.topic import Topic
    from busflow.interfaces.message import Message

DEFAULT_DEPTH = 1


class KeptMessages:
    """Keeps the last message of every topic, more where a launch file's `history:` says so."""

    def __init__(self, bus: Bus, depths: Mapping[str, int]) -> None:
        """Keep nothing yet; a kept topic costs one append to a deque per publish. `depths` are by final topic name."""
        self._bus, self._depths = bus, depths

    def follow(self, topic: Topic[Any]) -> None:
        """Keep a topic's messages from now on; calling it again has no effect."""
        if topic.recent is None:
            self._bus.keep_recent(topic, self.depth(topic.name))

    def depth(self, topic: str) -> int:
        """Return how many messages of a topic are kept."""
        return self._depths.get(topic, DEFAULT_DEPTH)

    def last(self, topic: Topic[Any], count: int) -> list[Message]:
        """Return up to `count` messages, the oldest first, including expired ones."""
        kept = tuple(topic.recent or ())[-count:] if count > 0 else ()
        return [message_of(item) for item in kept]

    def close(self) -> None:
        """Stop keeping messages."""
        for topic in self._bus.topics.values():
            self._bus.keep_recent(topic, 0)
