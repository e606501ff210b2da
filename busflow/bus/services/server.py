"""Server: the answering end of a service, and its counts of requests."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any, TypeAlias, cast

from busflow.bus.delivery import Recipient
from busflow.bus.failure import is_failure, refuse_coroutine
from busflow.bus.services.call import Activity, Call, Req, Res
from busflow.bus.services.service import Service
from busflow.bus.statistics import ServerStatistics
from busflow.errors import IncompatibleType, InvalidDeclaration, ServiceFailed, ServiceGone, ServiceUnavailable
from busflow.interfaces.message import Message, ServiceType, shown_value, type_name
from busflow.text import printable
from busflow.validation.tracebacks import reason, user_line

if TYPE_CHECKING:
    from busflow.bus.dispatcher import Dispatcher
    from busflow.bus.endpoint import ServiceEndpoint

RequestHandler: TypeAlias = Callable[[Req], Res] | Callable[[Req], Coroutine[Any, Any, Res]]
OnError: TypeAlias = Callable[[BaseException, Message], None]

DEPTH = 10
"""The default number of requests that may wait for a server."""


class Server(Recipient[Call[Req, Res], Service[Req, Res]]):
    """The answering end of a service: a bounded queue of requests, answered one at a time.

    A plain handler is atomic. An `async` one lets other handlers run where it awaits, but no second call of itself.
    An exception is raised in the caller as `ServiceFailed` and logged by the server's node, which goes on.
    """

    __slots__ = (
        "_function", "_on_error", "_serving", "_starting", "depth", "endpoint", "failed", "lost", "received",
        "refused", "served", "type", "withdrawn",
    )  # fmt: skip

    def __init__(
        self,
        service_type: type[ServiceType],
        endpoint: ServiceEndpoint,
        handler: RequestHandler[Req, Res],
        *,
        depth: int = DEPTH,
    ) -> None:
        """Create a server that `Bus.attach_server` connects later."""
        if isinstance(depth, bool) or not isinstance(depth, int) or depth < 1:  # type: ignore[redundant-expr]  # users without a type checker
            raise InvalidDeclaration(f"{endpoint.origin}: depth is a whole number from 1, got {printable(depth)!r}")
        super().__init__(
            deque[Any](), self._serve_async if iscoroutinefunction(handler) else self._serve, endpoint.origin
        )
        self.type: type[ServiceType] = service_type
        self.endpoint: ServiceEndpoint = endpoint
        self.depth: int = depth
        self.received: int = 0
        self.served: int = 0
        self.failed: int = 0
        self.refused: int = 0
        self.withdrawn: int = 0
        self.lost: int = 0
        self._function: Callable[[Req], Any] = handler
        self._serving: Call[Req, Res] | None = None
        self._starting: Activity | None = None
        self._on_error: OnError | None = None

    @property
    def service(self) -> str:
        """The service's final name."""
        return self.endpoint.service

    @property
    def node(self) -> str:
        """The full name of its node."""
        return self.endpoint.node

    def holder(self, call: Call[Req, Res]) -> Activity | None:  # noqa: ARG002  # it waits for the same as all others
        """Return the activity that must end before the next request is taken; used by busflow itself."""
        if self._serving is not None:
            return self._serving.activity
        return None if self._open else self._starting

    def statistics(self) -> ServerStatistics:
        """Return the server's current counts."""
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
            waiting=len(self.items) + (self._serving is not None),
        )

    # Called by the service.

    def accept(self, call: Call[Req, Res]) -> None:
        """Queue a request; used by busflow itself.

        Raises:
            ServiceUnavailable: the queue is full.
        """
        self.received += 1
        if len(self.items) >= self.depth:
            self.refused += 1
            raise ServiceUnavailable(
                f"{self.service} of {self.node} has no room for another request: {self.depth} wait already; ask it "
                "less often, or raise depth= where it is declared"
            )
        self.items.append(call)
        if self.idle:
            self.wake()

    def withdraw(self, call: Call[Req, Res]) -> None:
        """Remove a queued request; a request the handler has begun with goes on without a caller.

        Used by busflow itself.
        """
        if call in self.items:
            self.items.remove(call)
            self.withdrawn += 1

    def ask(self, request: Req, *, caller: str) -> Call[Req, Res]:
        """Send this server a request in the name of a client that cannot any more, as any request: taps see it too.

        Used by busflow itself.
        """
        service = cast("Service[Req, Res]", self._source)
        call = service.begin(request, caller=caller)
        call.reply.add_done_callback(lambda _: service.end(call))
        return call

    # Called by the bus and the node.

    def attach(self, service: Service[Req, Res], dispatcher: Dispatcher, starting: Activity, on_error: OnError) -> None:
        """Start to take the calls of a service; called by the bus.

        Args:
            service: The service to answer.
            dispatcher: Runs a plain handler.
            starting: The activity that delays requests until `open`.
            on_error: Called with each exception of the handler, and its request.
        """
        self._source, self._dispatcher, self._starting, self._on_error = service, dispatcher, starting, on_error
        service.join(self)

    def close(self) -> None:
        """Stop answering for good; every waiting call fails at once with `ServiceGone`."""
        if self._source is None:
            return
        service, self._source = self._source, None
        self.pause()
        lost = [*([self._serving] if self._serving else []), *self.items]
        self._serving = None
        self.items.clear()
        self._end_wait()
        self.lost += len(lost)
        for call in lost:
            call.fail(ServiceGone(f"{self.service}: its server {self.node} ended before it had answered"))
        service.leave(self)

    # Answering.

    def _serve(self, call: Call[Req, Res]) -> None:
        """Answer a request with the plain handler."""
        self._serving = call
        try:
            response = self._function(call.request)
            if type(response) is not self.type.Response:
                refuse_coroutine(response, self._origin)
        except BaseException as error:  # noqa: BLE001  # a handler may raise anything; its caller gets it
            self._failed(error, call)
        else:
            self._answer(call, response)

    async def _serve_async(self, call: Call[Req, Res]) -> None:
        """Answer a request with the `async` handler."""
        self._serving = call
        try:
            with call.activity.current():
                response = await self._function(call.request)
        except BaseException as error:
            if not is_failure(error):
                raise
            self._failed(error, call)
        else:
            self._answer(call, response)

    def _answer(self, call: Call[Req, Res], response: Any) -> None:
        if type(response) is not self.type.Response:
            wanted = type_name(self.type.Response)
            error = IncompatibleType(f"{self.endpoint.origin} must return a {wanted}, not {shown_value(response)}")
            self._failed(error, call)
        elif self._serving is call:  # otherwise the node has ended, and the call has failed
            self._serving = None
            self.served += 1
            call.succeed(cast("Res", response))

    def _failed(self, error: BaseException, item: Call[Req, Res]) -> None:
        cast("OnError", self._on_error)(error, item.request)
        if self._serving is item:
            self._serving = None
            self.failed += 1
            place = user_line(error)
            text, where = printable(reason(error), limit=400), f" ({place})" if place else ""
            failure = ServiceFailed(f"{self.service} failed in {self.node}: {text}{where}")
            failure.__cause__ = error
            item.fail(failure)

    def __repr__(self) -> str:
        s = self.statistics()
        return f"<Server {s.service} of {s.node}: {s.served} served, {s.failed} failed, {s.waiting} waiting>"
