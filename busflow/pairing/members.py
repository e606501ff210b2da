"""Members: the subscriptions of one group; their messages wait in their own queues until they are matched."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any, Protocol

from busflow.bus.endpoint import Endpoint
from busflow.bus.events import Event
from busflow.bus.expiry import message_of
from busflow.bus.queues import Queue
from busflow.bus.subscription import Subscription
from busflow.clock import nanoseconds_of
from busflow.errors import InvalidDeclaration
from busflow.interfaces.message import Message, type_name
from busflow.msgs.std_msgs import Header

SUPERSEDED = "superseded"
UNPAIRED = "unpaired"
"""The reason of a drop for a message that finds no partner."""


@dataclass(frozen=True, slots=True)
class Unpaired(Event):
    """A message found no partner on the other topics of its `@synchronized`, and was dropped."""

    message: Message
    nearest_s: float | None
    """How far its stamp is from the nearest of another topic; None where its queue was full without one."""


class Serving(Protocol):
    """Hands the messages of members to a handler."""

    def serve(self, limit: int) -> int:
        """Hand over up to `limit` groups of messages, and return how many."""
        ...

    def pump(self, member: Member) -> Coroutine[Any, Any, None] | None:
        """Return the task of an `async` handler, for the first member."""
        ...

    def wake_task(self) -> bool:
        """Wake that task; return False where there is none."""
        ...

    def remark(self, member: Member, nearest_s: float | None) -> str:
        """Say why a message of a member found no partner."""
        ...


class MemberQueue(Queue[Any]):
    """A queue of the newest messages, which drops the oldest for a reason of its own."""

    __slots__ = ("on_unpaired", "reason")

    def __init__(self, depth: int, reason: str) -> None:
        super().__init__(depth)
        self.reason: str = reason
        """The reason of each of its drops."""
        self.on_unpaired: Callable[[Any, float | None], None] | None = None

    def push(self, item: Any) -> None:
        """Add the message; without room, drop the oldest one."""
        if len(self.items) >= self.depth:
            self.drop(None)
        self.items.append(item)

    def drop(self, nearest_s: float | None) -> None:
        """Drop the oldest message, which found no partner."""
        item = self.items[0]
        self.discard(self.reason)
        if self.on_unpaired is not None:
            self.on_unpaired(message_of(item), nearest_s)


class Member(Subscription[Any]):
    """The subscription of one topic of a group."""

    delivered: int

    def __init__(self, message_type: type[Message], endpoint: Endpoint, group: Serving, queue: MemberQueue) -> None:
        """Create the subscription; drops of its queue are events where their reason is `unpaired`."""
        super().__init__(message_type, endpoint, _no_handler)
        self.remark: str = ""
        """The reason of its last drop in words, for `busflow doctor`."""
        self._group = group
        self._have(queue)
        self._link_queue()

    def _link_queue(self) -> None:
        if isinstance(self.queue, MemberQueue) and self.queue.reason == UNPAIRED:
            self.queue.on_unpaired = self._report

    def adopt(self, predecessor: Subscription[Any], on_failure: Any) -> None:
        """Take the place of the same subscription of the node's previous start, with its queue."""
        super().adopt(predecessor, on_failure)
        self._link_queue()

    def _report(self, message: Message, nearest_s: float | None) -> None:
        self.remark = self._group.remark(self, nearest_s)
        if self.on_event is not None:
            self.on_event(Unpaired(self.topic, message, nearest_s))

    def open(self) -> Coroutine[Any, Any, None] | None:
        """Start the delivery; the first member of an `async` handler returns its task."""
        self._open = True
        self.wake()
        return self._group.pump(self)

    def wake(self) -> None:
        """Let the group have a turn, because a message waits."""
        self.idle = False
        if not self._group.wake_task():
            self._dispatcher.schedule(self)  # type: ignore[union-attr]  # attached, or nothing would arrive

    def turn(self, limit: int) -> int:
        """Let the group hand over what belongs together; called by the dispatcher."""
        if not self._open:
            return 0
        handled = self._group.serve(limit)
        if self._open:
            if handled < limit:
                self.set_idle()
            else:
                self._dispatcher.ready.append(self)  # type: ignore[union-attr]  # attached, or it had no turn
        return handled

    def set_idle(self) -> None:
        """Let the next message wake the group."""
        self._set_idle()

    @property
    def is_receiving(self) -> bool:
        """Whether messages are handed over."""
        return self._open

    def stamps(self) -> list[int]:
        """Return the stamps of the messages that wait, in ns."""
        self.discard_expired()
        return [stamp_ns(message_of(each)) for each in self.items]

    def pop(self) -> Message:
        """Take the oldest message for the handler."""
        message = message_of(self.items.popleft())
        self.delivered += 1
        self._handler(message)  # type: ignore[misc]  # it is there, and what observes deliveries is around it
        if self._source is not None and self._source.waiting:
            self._source.grant()
        return message

    def drop(self, nearest_s: float | None) -> None:
        """Drop the oldest message, which found no partner."""
        if isinstance(self.queue, MemberQueue):
            self.queue.drop(nearest_s)

    def fail(self, error: BaseException, message: Message) -> None:
        """Report what the handler raised; the node fails."""
        self._failed(error, message)


def stamp_ns(message: Any) -> int:
    """Return the stamp of a message's header, in ns."""
    return nanoseconds_of(message.header.stamp)


def require_header(kind: type[Message], origin: str, topic: str) -> None:
    """Check that a type of messages has a header with a stamp.

    Raises:
        InvalidDeclaration: it has none.
    """
    header = kind.model_fields.get("header")
    if header is None or header.annotation is not Header:
        raise InvalidDeclaration(
            f"{origin} needs the stamp of a header, and {type_name(kind)} on {topic} has none; give the type a "
            "`header: Header` as its first field, or use @subscription alone"
        )


def _no_handler(_message: Any) -> None:
    """Do nothing: the group has the handler, and a subscription with one refuses to be pulled from."""
