"""Link: what a test, or the wire, may put between a topic and one of its subscriptions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from busflow.subscriptions import Subscription


class Link(Protocol):
    """What stands between a topic and one of its subscriptions, where something does."""

    target: Subscription[Any]

    @property
    def held(self) -> int:
        """Messages on their way: they count as queued."""
        ...

    def carry(self, item: Any) -> None:
        """Bring a message to the target, now or later, or lose it and count that."""
        ...
