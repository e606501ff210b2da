"""Client: the calling end of a service, and its counts of calls."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Generic, cast

from busflow.bus.services.call import Call, Req, Res, waited
from busflow.bus.services.service import Service
from busflow.bus.statistics import ClientStatistics
from busflow.errors import BusflowError, IncompatibleType, NotRunning
from busflow.interfaces.message import ServiceType, shown_value, type_name

if TYPE_CHECKING:
    from busflow.bus.endpoint import ServiceEndpoint

TIMEOUT_S = 5.0
"""The default timeout of a call, in seconds of the run's clock."""


class Client(Generic[Req, Res]):
    """The calling end of a service."""

    __slots__ = ("_open", "_service", "answered", "called", "cancelled", "endpoint", "errors", "type")

    def __init__(self, service_type: type[ServiceType], endpoint: ServiceEndpoint) -> None:
        """Create a client that `Bus.attach_client` connects later."""
        self.type: type[ServiceType] = service_type
        self.endpoint: ServiceEndpoint = endpoint
        self.called: int = 0
        self.answered: int = 0
        self.cancelled: int = 0
        self.errors: Counter[str] = Counter()
        self._service: Service[Req, Res]  # from `attach` on, also after `close`, for the calls that are still open
        self._open = False

    @property
    def service(self) -> str:
        """The service's final name."""
        return self.endpoint.service

    @property
    def available(self) -> bool:
        """Whether the service has a server now."""
        return self._open and self._service.server is not None

    async def call(self, request: Req | None = None, *, timeout: float | None = TIMEOUT_S) -> Res:  # noqa: ASYNC109  # by the run's clock, and distinct from the caller's own
        """Send a request, and wait for the answer.

        If the caller is cancelled or times out, a request that is still queued is withdrawn; a handler that has
        begun with it is not interrupted.

        Args:
            request: The request; by default one with default values.
            timeout: Seconds of the run's clock, or None for no limit.

        Raises:
            ServiceUnavailable: the service has no server, or its server has no room.
            ServiceFailed: the server's handler raised; the error carries its text.
            ServiceGone: the server's node ended before it had answered.
            ServiceTimeout: there was no answer in time.
            DeadlockError: the server waits, directly or through others, for the caller.
            IncompatibleType: the request is of another type.
        """
        check_timeout(timeout)
        return await self.answer(self.begin(request, timeout=timeout))

    # The steps of a call, for what waits otherwise.

    def begin(self, request: Req | None = None, *, timeout: float | None = None) -> Call[Req, Res]:
        """Send a request without waiting, and return its call, which `answer` or `end` must follow.

        What `call` raises is the exception of its reply.
        """
        service = self._attached()
        call = service.begin(self._checked(request), caller=self.endpoint.node, timeout_s=timeout)
        self.called += 1
        return call

    async def answer(self, call: Call[Req, Res]) -> Res:
        """Wait for the answer to a call, and end the call."""
        try:
            return await waited(call, call.reply)
        finally:
            self.end(call)

    def end(self, call: Call[Req, Res]) -> Res | BaseException:
        """End a call, count how, and return its outcome; one without an answer is withdrawn."""
        outcome = self._service.end(call)
        if isinstance(outcome, BusflowError):
            self.errors[type(outcome).__name__] += 1
        elif isinstance(outcome, BaseException):
            self.cancelled += 1
        else:
            self.answered += 1
        return outcome

    def refuse_cycle(self, call: Call[Req, Res]) -> None:
        """Refuse to wait for a call that waits for the running code.

        Raises:
            DeadlockError: naming the chain.
        """
        self._attached().refuse_cycle(call)

    def _checked(self, request: Req | None) -> Req:
        asked = cast("Req", self.type.Request()) if request is None else request
        if type(asked) is not self.type.Request:
            wanted = type_name(self.type.Request)
            raise IncompatibleType(
                f"{self.endpoint.origin} asks {self.service} with a {wanted}, not {shown_value(asked)}"
            )
        return asked

    async def ready(self, *, timeout: float | None = TIMEOUT_S) -> bool:  # noqa: ASYNC109  # as above
        """Wait until the service has a server, and return True, for a loop as ROS 2's: `while not await ….ready()`.

        Raises:
            ServiceUnavailable: no server came in time.
        """
        check_timeout(timeout)
        await self._attached().wait_for_server(timeout)
        return True

    def statistics(self) -> ClientStatistics:
        """Return the client's current counts."""
        failed = self.errors.total()
        return ClientStatistics(
            node=self.endpoint.node,
            service=self.service,
            called=self.called,
            answered=self.answered,
            failed=failed,
            timed_out=self.errors["ServiceTimeout"],
            cancelled=self.cancelled,
            waiting=self.called - self.answered - failed - self.cancelled,
            errors=dict(self.errors),
        )

    def attach(self, service: Service[Req, Res]) -> None:
        """Connect to a service; called by the bus."""
        self._service, self._open = service, True
        service.clients.append(self)

    def close(self) -> None:
        """Leave the service."""
        if self._open:
            self._open = False
            self._service.forget_client(self)

    def _attached(self) -> Service[Req, Res]:
        if not self._open:
            raise NotRunning(f"the client of {self.service} in {self.endpoint.node} is not part of a running graph")
        return self._service

    def __repr__(self) -> str:
        s = self.statistics()
        return f"<Client {s.service} of {s.node}: {s.answered} answered, {s.failed} failed, {s.waiting} waiting>"


def check_timeout(timeout_s: float | None) -> None:
    """Refuse a timeout that is not positive and finite.

    Raises:
        ValueError: it is not a positive number of seconds.
    """
    if timeout_s is not None and not 0 < timeout_s < float("inf"):
        raise ValueError(f"timeout is a number of seconds above 0, or None for no limit, not {timeout_s!r}")
