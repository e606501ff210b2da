"""Origins: where the message comes from that a tap hears: from a node here, or from which one of another process."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.bus.topic import Topic


class Origins:
    """Follows who publishes on one topic, for a tap that asks once at each message."""

    def __init__(self, topic: Topic[Any]) -> None:
        """Follow from now on."""
        self._topic = topic
        self._seen = topic.arrived
        self._by_node = self._counts()

    def of_this(self) -> str | None:
        """The node elsewhere whose message is being published here; None where the publisher is of this process.

        A tap hears of a message when its publisher has counted it.
        """
        arrived = self._topic.arrived
        if arrived == self._seen:
            return None
        self._seen = arrived
        before, self._by_node = self._by_node, self._counts()
        return next((node for node, count in self._by_node.items() if count != before.get(node, 0)), "")

    def _counts(self) -> Counter[str]:
        found = Counter[str]()
        for each in self._topic.publishers:
            if each.endpoint.remote:
                found[each.endpoint.node] += each.published
        return found
