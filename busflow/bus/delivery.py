"""Recipient: the part of a subscription that every message goes through, from its queue to its handler.

Theory of operation. What a delivery costs is decided in four places: `Publisher.publish`, `Topic.wake`, the loop of
the dispatcher, and here. Of the ten bare calls of a Python function (43 ns each, where this was measured) that a
message costs in a burst of 64,

    4  are the publish: the call, the thread and the type looked at, the count, and a deque's append, in C
    3  are the turn: the message taken, counted and handed over, of which the call of the handler is one
    3  are shared with other messages: the turns of the dispatcher (eight), the turn of the loop (all of the burst)

and each further subscription adds half a call for its append and those three for its turn. So whatever is done here
once per message is done because a promise needs it: `delivered` is counted before the handler may look at it, and who
was paused by its own handler is handed nothing more. What a subtraction tells when somebody asks (how many messages
overflowed) is not counted, and whoever wants more than the plain case (losses that are heard of, links, deadlines) has
a slower way in, which that subscription alone pays for.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from busflow.bus.endpoint import Endpoint
from busflow.bus.expiry import Perishable, fresh
from busflow.bus.failure import is_failure, refuse_coroutine
from busflow.bus.queues import Queue, create_queue
from busflow.errors import Occupied
from busflow.interfaces.message import Message

if TYPE_CHECKING:
    from busflow.bus.dispatcher import Dispatcher
    from busflow.bus.topic import Topic
    from busflow.clock import Clock

M = TypeVar("M", bound=Message)

MessageHandler = Callable[[M], None] | Callable[[M], Coroutine[Any, Any, None]]
OnFailure = Callable[[BaseException, Message], None]


class Recipient(Generic[M]):
    """A bounded queue and who it is emptied into: a handler, plain or `async`, or a task that pulls.

    A recipient is `idle` while nothing waits and somebody wants to know when something does.
    """

    __slots__ = (
        "_clock", "_dispatcher", "_doorbell", "_handler", "_is_async", "_on_failure", "_open", "_topic", "delivered",
        "endpoint", "idle", "items", "queue",
    )  # fmt: skip

    def __init__(self, endpoint: Endpoint, handler: MessageHandler[M] | None) -> None:
        self.endpoint = endpoint
        self.delivered: int = 0
        self.idle = False
        self._have(create_queue(endpoint.qos.overflow, endpoint.qos.depth))
        self._handler = handler
        self._is_async = iscoroutinefunction(handler)
        self._topic: Topic[M] | None = None
        self._clock: Clock | None = None
        self._dispatcher: Dispatcher | None = None
        self._on_failure: OnFailure | None = None
        self._doorbell: asyncio.Future[None] | None = None
        self._open = False

    def _have(self, queue: Queue[M | Perishable[M]]) -> None:
        """Take from this queue; what waits in it is looked at so often that it is at hand here too."""
        self.queue, self.items = queue, queue.items

    def wake(self) -> None:
        """Something waits: a plain handler gets in line, a task is woken."""
        self.idle = False
        if self._doorbell is None:
            self._dispatcher.schedule(self)  # type: ignore[union-attr]  # attached, or nothing would arrive
        elif not self._doorbell.done():
            self._doorbell.set_result(None)

    def turn(self, limit: int) -> int:
        """Hand up to `limit` messages to the plain handler; called by the dispatcher."""
        if not self._open:  # it was paused, or has left, after it had got in line
            return 0
        items: Any = self.items
        handler: Any = self._handler
        topic: Any = self._topic
        before = delivered = self.delivered
        most = before + limit
        message: Any = None
        # One `try` around all of them costs what one around each would: nothing, until something is raised.
        try:
            while items and delivered < most and self._open:
                message = items.popleft()
                if topic.perishable and (message := self._fresh(message)) is None:
                    continue
                self.delivered = delivered = delivered + 1
                if (result := handler(message)) is not None:
                    refuse_coroutine(result, self.endpoint.origin)
        except BaseException as error:  # noqa: BLE001  # a handler may raise anything; its node answers for it
            self._failed(error, message)
        if topic.waiting:
            topic.grant()
        if self._open:
            if items:
                self._dispatcher.ready.append(self)  # type: ignore[union-attr]  # attached, or it had no turn
            else:
                self.idle = topic.idle = True
        return delivered - before

    async def _pump(self, handler: Callable[[M], Any]) -> None:
        """Hand messages to an `async` handler, one at a time, and give the loop its turn between batches."""
        dispatcher: Dispatcher = self._dispatcher  # type: ignore[assignment]  # attached before it is opened
        items: Any = self.items
        topic: Any = self._topic
        message: Any = None
        while self._open:
            if not items:
                await self._ring()
            handled, started = 0, dispatcher.now()
            while items and self._open:
                message = items.popleft()
                if topic.waiting:
                    topic.grant()
                if topic.perishable and (message := self._fresh(message)) is None:
                    continue
                handled += 1
                self.delivered += 1
                try:
                    await handler(message)
                except BaseException as error:
                    if not is_failure(error):
                        raise
                    self._failed(error, message)
                    return
                if handled % dispatcher.quantum == 0 and dispatcher.spent(started, handled):
                    await dispatcher.rest()
                    handled, started = 0, dispatcher.now()

    async def _ring(self) -> None:
        """Wait until something arrives, or the subscription ends."""
        if self._doorbell is not None:
            raise Occupied(f"two tasks wait for {self.endpoint.topic} in {self.endpoint.node}; subscribe twice instead")
        self._doorbell = asyncio.get_running_loop().create_future()
        self._rest()
        try:
            await self._doorbell
        finally:
            self._doorbell = None
            self.idle = False

    def _rest(self) -> None:
        """Have the topic tell when something waits again."""
        self.idle = True
        if self._topic is not None:
            self._topic.idle = True

    def _fresh(self, item: M | Perishable[M]) -> M | None:
        """The message of an item, or None and one more drop when it has expired."""
        message = fresh(item, self._clock) if isinstance(item, Perishable) and self._clock is not None else item
        if message is None:
            self.queue.drops["expired"] += 1
        return message  # type: ignore[return-value]  # a Perishable is unpacked above once there is a clock

    def pause(self) -> None:
        """Hand over no more; what arrives waits in the queue."""
        self._open = False
        self.idle = False

    def _failed(self, error: BaseException, message: Any) -> None:
        self.pause()
        cast("OnFailure", self._on_failure)(error, message)
