"""Origins: the publisher of a tapped message: a node of this process, or the name of a remote node."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.bus.topic import Topic


class Origins:
    """Tracks the publishers of one topic, for a tap that calls `of_this` once per message."""

    def __init__(self, topic: Topic[Any]) -> None:
        """Start to track."""
        self._topic = topic
        self._seen = topic.arrived
        self._by_node = self._counts()

    def of_this(self) -> str | None:
        """Return the remote node that published the current message; None if its publisher is in this process.

        A publisher counts a message before taps are called, so the count that changed names the node.
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
