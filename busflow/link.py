"""Link: what a test may put between a topic and one of its subscriptions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from busflow.subscriptions import Subscription


class Link(Protocol):
    """What stands between a topic and one of its subscriptions, where a test put something there."""

    target: Subscription[Any]
    held: int
    """Messages on their way: they count as queued."""

    def carry(self, item: Any) -> None:
        """Bring a message to the target, now or later, or lose it and count that."""
        ...
