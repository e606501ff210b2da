"""Server: the answering end of a service, and its account of every request."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Coroutine
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any, Generic, TypeAlias, cast

from busflow.bus.call import Activity, Call, Req, Res
from busflow.bus.failure import is_failure, refuse_coroutine
from busflow.bus.service import Service
from busflow.bus.statistics import ServerStatistics
from busflow.errors import IncompatibleType, InvalidDeclaration, ServiceFailed, ServiceGone, ServiceUnavailable
from busflow.interfaces.message import Message, ServiceType, type_name
from busflow.text import printable
from busflow.validation.tracebacks import reason

if TYPE_CHECKING:
    from busflow.bus.dispatcher import Dispatcher
    from busflow.bus.endpoint import ServiceEndpoint

RequestHandler: TypeAlias = Callable[[Req], Res] | Callable[[Req], Coroutine[Any, Any, Res]]
OnError: TypeAlias = Callable[[BaseException, Message], None]

DEPTH = 10
"""How many requests may wait for a server unless it says otherwise."""


class Server(Generic[Req, Res]):
    """The answering end of a service: a bounded queue of requests, answered one at a time.

    A plain handler is atomic; an `async` one lets others run where it awaits, but never itself. What it raises is
    told to the caller, and logged by its own node, which goes on.
    """

    __slots__ = (
        "_dispatcher", "_doorbell", "_handler", "_idle", "_is_async", "_on_error", "_open", "_queue", "_service",
        "_serving", "_starting", "depth", "endpoint", "failed", "lost", "received", "refused", "served", "type",
        "withdrawn",
    )  # fmt: skip

    def __init__(
        self,
        service_type: type[ServiceType],
        endpoint: ServiceEndpoint,
        handler: RequestHandler[Req, Res],
        *,
        depth: int = DEPTH,
    ) -> None:
        """A server that `Bus.attach_server` has yet to connect."""
        if isinstance(depth, bool) or not isinstance(depth, int) or depth < 1:  # type: ignore[redundant-expr]  # users without a type checker
            raise InvalidDeclaration(f"{endpoint.origin}: depth is a whole number from 1, got {printable(depth)!r}")
        self.type = service_type
        self.endpoint = endpoint
        self.depth = depth
        self.received = self.served = self.failed = self.refused = self.withdrawn = self.lost = 0
        self._handler: Callable[[Req], Any] = handler
        self._is_async = iscoroutinefunction(handler)
        self._queue: deque[Call[Req, Res]] = deque()
        self._serving: Call[Req, Res] | None = None
        self._service: Service[Req, Res] | None = None
        self._dispatcher: Dispatcher | None = None
        self._starting: Activity | None = None
        self._on_error: OnError | None = None
        self._doorbell: asyncio.Future[None] | None = None
        self._idle = False
        self._open = False

    @property
    def service(self) -> str:
        """The service's final name."""
        return self.endpoint.service

    @property
    def node(self) -> str:
        """The full name of its node."""
        return self.endpoint.node

    @property
    def holder(self) -> Activity | None:
        """What has to end before the next request is taken."""
        if self._serving is not None:
            return self._serving.activity
        return None if self._open else self._starting

    def statistics(self) -> ServerStatistics:
        """The server's account, as it stands now."""
        return ServerStatistics(
            node=self.node,
            service=self.service,
            depth=self.depth,
            received=self.received,
            served=self.served,
            failed=self.failed,
            refused=self.refused,
            withdrawn=self.withdrawn,
            lost=self.lost,
            waiting=len(self._queue) + (self._serving is not None),
        )

    # What a service asks of it.

    def accept(self, call: Call[Req, Res]) -> None:
        """Queue a request.

        Raises:
            ServiceUnavailable: the queue is full.
        """
        self.received += 1
        if len(self._queue) >= self.depth:
            self.refused += 1
            raise ServiceUnavailable(
                f"{self.service} of {self.node} has no room for another request: {self.depth} wait already; ask it "
                "less often, or raise depth= where it is declared"
            )
        self._queue.append(call)
        if self._idle:
            self._wake()

    def withdraw(self, call: Call[Req, Res]) -> None:
        """Forget a request that still waits; one that the handler has begun with goes on, for nobody."""
        if call in self._queue:
            self._queue.remove(call)
            self.withdrawn += 1

    # What its node asks of it.

    def attach(self, service: Service[Req, Res], dispatcher: Dispatcher, starting: Activity, on_error: OnError) -> None:
        """Take a service's calls from now on; called by the bus.

        Args:
            service: What it answers.
            dispatcher: Gives a plain handler its turn.
            starting: What holds the requests up until `open`.
            on_error: Hears of what the handler raises, and of which request.
        """
        self._service, self._dispatcher, self._starting, self._on_error = service, dispatcher, starting, on_error
        service.join(self)

    def open(self) -> Coroutine[Any, Any, None] | None:
        """Begin to answer; an `async` handler needs the returned coroutine run as a task of its node."""
        self._open = True
        if self._is_async:
            return self._pump()
        if self._queue:
            self._wake()
        else:
            self._idle = True
        return None

    def close(self) -> None:
        """Answer no more, for good: whoever waits hears at once that the server has gone."""
        if self._service is None:
            return
        service, self._service = self._service, None
        self._open = self._idle = False
        lost = [*([self._serving] if self._serving else []), *self._queue]
        self._serving = None
        self._queue.clear()
        self._ring()
        self.lost += len(lost)
        for call in lost:
            call.fail(ServiceGone(f"{self.service}: its server {self.node} ended before it had answered"))
        service.leave(self)

    # Answering.

    def turn(self, limit: int) -> int:
        """Let the plain handler answer up to `limit` requests; called by the dispatcher."""
        handled = 0
        while self._queue and handled < limit and self._open:
            handled += 1
            call = self._next()
            try:
                response = self._handler(call.request)
                refuse_coroutine(response, self.endpoint.origin)
            except BaseException as error:  # noqa: BLE001  # a handler may raise anything; its caller is told
                self._failed(call, error)
            else:
                self._answer(call, response)
        if self._open:
            if self._queue:
                cast("Dispatcher", self._dispatcher).ready.append(self)
            else:
                self._idle = True
        return handled

    async def _pump(self) -> None:
        """Let an `async` handler answer, one request at a time, and give the loop its turn between batches."""
        dispatcher = cast("Dispatcher", self._dispatcher)
        handled, started = 0, dispatcher.now()
        while self._open:
            if not self._queue:
                await self._arrival()
                handled, started = 0, dispatcher.now()
                continue
            call = self._next()
            handled += 1
            try:
                with call.activity.current():
                    response = await self._handler(call.request)
            except BaseException as error:
                if not is_failure(error):
                    raise
                self._failed(call, error)
            else:
                self._answer(call, response)
            if dispatcher.spent(started, handled):
                await dispatcher.rest()
                handled, started = 0, dispatcher.now()

    def _next(self) -> Call[Req, Res]:
        self._serving = call = self._queue.popleft()
        return call

    def _answer(self, call: Call[Req, Res], response: Any) -> None:
        if type(response) is not self.type.Response:
            given = type_name(type(response)) if isinstance(response, Message) else repr(response)
            wanted = type_name(self.type.Response)
            error = IncompatibleType(
                f"{self.endpoint.origin} must return a {wanted}, not {printable(given, limit=200)}"
            )
            self._failed(call, error)
        elif self._serving is call:  # otherwise the node ended meanwhile, and the caller was told so
            self._serving = None
            self.served += 1
            call.succeed(cast("Res", response))

    def _failed(self, call: Call[Req, Res], error: BaseException) -> None:
        cast("OnError", self._on_error)(error, call.request)
        if self._serving is call:
            self._serving = None
            self.failed += 1
            told = ServiceFailed(f"{self.service} failed in {self.node}: {printable(reason(error), limit=400)}")
            told.__cause__ = error
            call.fail(told)

    def _wake(self) -> None:
        self._idle = False
        if self._is_async:
            self._ring()
        else:
            cast("Dispatcher", self._dispatcher).schedule(self)

    async def _arrival(self) -> None:
        self._doorbell = asyncio.get_running_loop().create_future()
        self._idle = True
        try:
            await self._doorbell
        finally:
            self._doorbell = None

    def _ring(self) -> None:
        if self._doorbell is not None and not self._doorbell.done():
            self._doorbell.set_result(None)

    def __repr__(self) -> str:
        s = self.statistics()
        return f"<Server {s.service} of {s.node}: {s.served} served, {s.failed} failed, {s.waiting} waiting>"
