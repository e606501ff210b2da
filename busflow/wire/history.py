"""History: the last messages of each topic, kept by reference so that `--last` finds them, also on volatile topics."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.bus import Bus
    from busflow.message import Message
    from busflow.topic import Topic

DEFAULT_DEPTH = 1


class History:
    """Keeps the last message of every topic, more where a launch file's `history:` says so."""

    def __init__(self, bus: Bus, depths: Mapping[str, int]) -> None:
        """A history that costs one append of a deque per publish; `depths` by final topic name."""
        self._bus, self._depths = bus, depths
        self._kept: dict[str, deque[Message]] = {}

    def follow(self, topic: Topic[Any]) -> None:
        """Keep what is published on a topic from now on; once is enough."""
        if topic.name not in self._kept:
            kept: deque[Message] = deque(maxlen=self.depth(topic.name))
            self._kept[topic.name] = kept
            if kept.maxlen:
                self._bus.tap(topic, kept.append)

    def depth(self, topic: str) -> int:
        """How many messages of a topic are kept."""
        return self._depths.get(topic, DEFAULT_DEPTH)

    def last(self, topic: str, count: int) -> list[Message]:
        """Up to `count` messages, the oldest first."""
        return list(self._kept.get(topic, ()))[-count:] if count > 0 else []
