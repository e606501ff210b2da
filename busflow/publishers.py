"""Publisher: the sending end of a topic.

Theory of operation. A publish is a loop over the topic's tuple of bound `push` methods. Whatever needs more than that
(a blocking queue, a kept history, another thread, an endpoint that is not attached) makes the publisher take
`_publish_carefully`, so the common path pays for one flag, one comparison of types and one thread number.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from threading import get_ident
from typing import TYPE_CHECKING, Generic, TypeVar

from busflow.endpoint import Endpoint
from busflow.errors import IncompatibleType, NotRunning, WouldBlock
from busflow.message import Message, type_name
from busflow.qos import Durability
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.topic import Topic

M = TypeVar("M", bound=Message)


class Publisher(Generic[M]):
    """The sending end of a topic."""

    __slots__ = ("_direct", "_hand_over", "_history", "_thread", "_topic", "endpoint", "published", "type")

    def __init__(self, message_type: type[M], endpoint: Endpoint) -> None:
        """A publisher that `Bus.attach_publisher` has yet to connect."""
        self.type = message_type
        self.endpoint = endpoint
        self.published = 0
        self._topic: Topic[M] | None = None
        self._direct = False
        self._thread = 0
        self._hand_over: Callable[[Callable[[], None]], None] | None = None
        qos = endpoint.qos
        latched = qos.durability is Durability.TRANSIENT_LOCAL
        self._history: deque[tuple[int, M]] | None = deque(maxlen=qos.depth) if latched else None

    @property
    def topic(self) -> str:
        """The topic's final name."""
        return self.endpoint.topic

    @property
    def subscription_count(self) -> int:
        """How many subscriptions receive what is published here."""
        return len(self._topic.subscriptions) if self._topic else 0

    def publish(self, message: M) -> None:
        """Hand a message to every subscription's queue, without waiting.

        From another thread the message is handed to the loop, in order, through the bus's bounded inbox.

        Raises:
            IncompatibleType: the message is not exactly of the topic's type.
            WouldBlock: a subscription with `overflow: block` has no room, or a `send` is waiting; nobody got it.
            NotRunning: the publisher belongs to no running graph.
        """
        if self._direct and type(message) is self.type and get_ident() == self._thread:
            self.published += 1
            for push in self._topic.pushes:  # type: ignore[union-attr]  # _direct implies a topic
                push(message)
        else:
            self._publish_carefully(message)

    async def send(self, message: M) -> None:
        """Publish once every `overflow: block` subscription has room; first come, first served.

        Raises:
            SendTimeout: no room within the subscription's `block_timeout_s`; nobody got it.
            IncompatibleType, NotRunning: as `publish`.
        """
        topic = self._attached(message)
        if get_ident() != self._thread:
            raise NotRunning(f"send on {topic.name} must be awaited on the graph's own event loop; use publish")
        if topic.waiting or topic.first_full() is not None:
            await topic.wait_for_room()
        try:
            self._deliver(topic, message)
        finally:
            topic.grant()

    def _publish_carefully(self, message: M) -> None:
        topic = self._attached(message)
        if get_ident() != self._thread:
            if self._hand_over is None:
                raise NotRunning(f"publish on {topic.name} came from a thread before the graph was started")
            self._hand_over(lambda: self.publish(message))
            return
        full = topic.first_full()
        if full is not None:
            raise WouldBlock(
                f"{full.endpoint.node} has no room for a message on {topic.name} (overflow: block, depth "
                f"{full.endpoint.qos.depth}); await send(), raise its depth, or choose overflow: drop_oldest"
            )
        if topic.waiting:
            raise WouldBlock(f"a send() on {topic.name} is waiting its turn; await send() to queue behind it")
        self._deliver(topic, message)

    def _deliver(self, topic: Topic[M], message: M) -> None:
        self.published += 1
        if self._history is not None:
            self._history.append((topic.published, message))
        for push in topic.pushes:
            push(message)

    def _attached(self, message: M) -> Topic[M]:
        if type(message) is not self.type:
            raise IncompatibleType(
                f"{self.endpoint.node} publishes {type_name(self.type)} on {self.topic}, but was given "
                f"{printable(_type_shown(message), limit=200)}"
            )
        if self._topic is None:
            raise NotRunning(f"the publisher of {self.topic} in {self.endpoint.node} is not part of a running graph")
        return self._topic

    def attach(self, topic: Topic[M], thread: int, hand_over: Callable[[Callable[[], None]], None] | None) -> None:
        """Connect to a topic; called by the bus."""
        self._topic, self._thread, self._hand_over = topic, thread, hand_over
        topic.publishers.append(self)
        topic.rebuild()

    def close(self) -> None:
        """Leave the topic: what was published stays counted, what was kept for late joiners is gone."""
        if self._topic is not None:
            topic, self._topic, self._direct = self._topic, None, False
            topic.forget_publisher(self)

    def adjust(self) -> None:
        """Learn whether the short path is open; called by the topic when its ends change."""
        self._direct = self._topic is not None and not self._topic.blocking and self._history is None

    @property
    def history(self) -> tuple[tuple[int, M], ...]:
        """What a transient_local publisher keeps for late joiners: (order on the topic, message)."""
        return tuple(self._history or ())

    def __repr__(self) -> str:
        return f"<Publisher {self.topic} of {self.endpoint.node}: {self.published} published>"


def _type_shown(message: object) -> str:
    """What was given instead of a message, in words."""
    if isinstance(message, Message):
        return type_name(type(message))
    return f"{type(message).__name__} {message!r}"
