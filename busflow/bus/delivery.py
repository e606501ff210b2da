"""Recipient: delivers queued items, the messages of a topic or the requests of a service, to a handler.

Theory of operation. The cost of a delivery is decided in four places: `Publisher.publish`, `Topic.wake`, the loop of
the dispatcher, and here. A message in a burst of 64 costs as much as ten empty calls of a Python function (43 ns each
on the machine where this was measured):

    4  for the publish: the call, the checks of thread and type, the count, and a deque's append, in C
    3  for the turn: the message is taken, counted and given to the handler, whose call is one of the three
    3  shared with other messages: a turn of the dispatcher (by eight), a turn of the loop (by the whole burst)

Each further subscription adds half a call for its append and three for its turn. So each step here that runs once per
message is needed for a promise: `delivered` is counted before the handler can read it, and a recipient that was paused
by its own handler gets no further message. A count that a subtraction can give on request (overflow) is not kept.
A subscription that needs more than the plain case (observed drops, links, deadlines) has a slower push function, and
only that subscription pays for it.
"""

from __future__ import annotations

import asyncio
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable, Coroutine
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from busflow.bus.failure import is_failure, refuse_coroutine

if TYPE_CHECKING:
    from busflow.bus.dispatcher import Dispatcher

T = TypeVar("T")
S = TypeVar("S", bound="DeliverySource")


class DeliverySource:
    """The source of recipients: a topic, or a service, where nothing expires and no sender waits for room."""

    __slots__ = ("idle", "perishable", "waiting")

    def __init__(self) -> None:
        self.idle: bool = False
        """Whether a recipient may have to be woken when an item arrives."""
        self.perishable: bool = False
        """Whether queued items may expire."""
        self.waiting: list[asyncio.Future[None]] = []  # an empty deque takes 700 bytes more, and few topics block
        """One future for each sender that waits for room."""

    def grant(self) -> None:
        """Wake the first waiting sender if there is room; only a topic has senders that wait."""


class Recipient(ABC, Generic[T, S]):
    """Delivers queued items to a handler, plain or `async`, or to a task that pulls.

    A recipient is `idle` while its queue is empty and it has to be woken when an item arrives.
    """

    __slots__ = (
        "_dispatcher", "_handler", "_is_async", "_open", "_origin", "_source", "_wakeup", "delivered", "idle",
        "items",
    )  # fmt: skip

    def __init__(self, items: deque[Any], handler: Callable[[T], Any] | None, origin: str) -> None:
        """Create a recipient of the queue `items`; it is attached to a source and opened later."""
        self.items: deque[Any] = items
        self.delivered: int = 0
        """The number of items given to the handler or a task."""
        self.idle = False
        self._handler = handler
        self._is_async = iscoroutinefunction(handler)
        self._origin = origin
        self._source: S | None = None
        self._dispatcher: Dispatcher | None = None
        self._wakeup: asyncio.Future[None] | None = None
        self._open = False

    @abstractmethod
    def _failed(self, error: BaseException, item: Any) -> None:
        """Handle an exception that the handler raised for an item."""

    def _fresh(self, item: Any) -> T | None:
        """Return the handler's argument for an item, or None if it has expired; called if the source is perishable."""
        return item  # pragma: no cover  # requests do not expire, and a subscription has its own

    def open(self) -> Coroutine[Any, Any, None] | None:
        """Start the delivery; for an `async` handler, the node must run the returned coroutine as a task.

        Used by busflow itself.
        """
        self._open = True
        if self._handler is None:
            return None
        if self._is_async:
            return self._pump(self._handler)
        if self.items:
            self.wake()
        else:
            self._set_idle()
        return None

    def wake(self) -> None:
        """Schedule the plain handler, or wake the task, because an item waits; used by busflow itself."""
        self.idle = False
        if self._wakeup is None:
            self._dispatcher.schedule(self)  # type: ignore[union-attr]  # attached, or nothing would arrive
        elif not self._wakeup.done():
            self._wakeup.set_result(None)

    def turn(self, limit: int) -> int:
        """Deliver up to `limit` items to the plain handler and return how many; called by the dispatcher."""
        if not self._open:  # paused or closed after it was scheduled
            return 0
        items: Any = self.items
        handler: Any = self._handler
        source: Any = self._source
        before = delivered = self.delivered
        last = before + limit
        message: Any = None
        # One `try` around the loop is as cheap as none, until something is raised.
        try:
            while items and delivered < last and self._open:
                message = items.popleft()
                if source.perishable and (message := self._fresh(message)) is None:
                    continue
                self.delivered = delivered = delivered + 1
                if (result := handler(message)) is not None:
                    refuse_coroutine(result, self._origin)
        except BaseException as error:  # noqa: BLE001  # a handler may raise anything; its node fails
            self._failed(error, message)
        if source.waiting:
            source.grant()
        if self._open:
            if items:
                self._dispatcher.ready.append(self)  # type: ignore[union-attr]  # attached, or it had no turn
            else:
                self.idle = source.idle = True
        return delivered - before

    async def _pump(self, handler: Callable[[T], Any]) -> None:
        """Deliver items to an `async` handler one at a time, and yield to the event loop between batches."""
        dispatcher: Dispatcher = self._dispatcher  # type: ignore[assignment]  # attached before it is opened
        items: Any = self.items
        source: Any = self._source
        message: Any = None
        while self._open:
            if not items:
                await self._wait()
            handled, started = 0, dispatcher.now()
            while items and self._open:
                message = items.popleft()
                if source.waiting:
                    source.grant()
                if source.perishable and (message := self._fresh(message)) is None:
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

    async def _wait(self) -> None:
        """Wait until an item arrives or the recipient closes."""
        self._wakeup = asyncio.get_running_loop().create_future()
        self._set_idle()
        try:
            await self._wakeup
        finally:
            self._wakeup = None
            self.idle = False

    def _end_wait(self) -> None:
        if self._wakeup is not None and not self._wakeup.done():
            self._wakeup.set_result(None)

    def _set_idle(self) -> None:
        """Let the source wake this recipient when the next item arrives."""
        self.idle = True
        if self._source is not None:
            self._source.idle = True

    def pause(self) -> None:
        """Stop the delivery; arriving items stay queued. Used by busflow itself."""
        self._open = False
        self.idle: bool = False
