"""Client: the calling end of a service, and its counts of calls."""

from __future__ import annotations

from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Generic, cast

from busflow.bus.services.call import Call, Req, Res
from busflow.bus.services.service import Service
from busflow.bus.statistics import ClientStatistics
from busflow.errors import BusflowError, IncompatibleType, NotRunning
from busflow.interfaces.message import Message, ServiceType, type_name
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.bus.endpoint import ServiceEndpoint

TIMEOUT_S = 5.0
"""The default timeout of a call, in seconds of the run's clock."""


class Client(Generic[Req, Res]):
    """The calling end of a service."""

    __slots__ = ("_service", "answered", "called", "cancelled", "endpoint", "errors", "type")

    def __init__(self, service_type: type[ServiceType], endpoint: ServiceEndpoint) -> None:
        """Create a client that `Bus.attach_client` connects later."""
        self.type: type[ServiceType] = service_type
        self.endpoint: ServiceEndpoint = endpoint
        self.called: int = 0
        self.answered: int = 0
        self.cancelled: int = 0
        self.errors: Counter[str] = Counter()
        self._service: Service[Req, Res] | None = None

    @property
    def service(self) -> str:
        """The service's final name."""
        return self.endpoint.service

    @property
    def available(self) -> bool:
        """Whether the service has a server now."""
        return self._service is not None and self._service.server is not None

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
        service = self._attached()
        asked = self._checked(request)
        check_timeout(timeout)
        self.called += 1
        try:
            response = await service.call(asked, caller=self.endpoint.node, timeout_s=timeout)
        except BusflowError as error:
            self.errors[type(error).__name__] += 1
            raise
        except BaseException:
            self.cancelled += 1
            raise
        self.answered += 1
        return response

    def post(self, request: Req, *, timeout: float | None = None) -> Call[Req, Res]:
        """Send a request without waiting, and return its call: `reply` is the future answer.

        To cancel the reply withdraws the request. What `call` raises when it is awaited is the reply's exception.
        """
        service = self._attached()
        call = service.begin(self._checked(request), caller=self.endpoint.node, timeout_s=timeout)
        self.called += 1
        call.reply.add_done_callback(partial(self._ended, service, call))
        return call

    def refuse_cycle(self, call: Call[Req, Res]) -> None:
        """Refuse to wait for a posted call that waits for the running code.

        Raises:
            DeadlockError: naming the chain.
        """
        self._attached().refuse_cycle(call)

    def _ended(self, service: Service[Req, Res], call: Call[Req, Res], _reply: object) -> None:
        service.end(call)
        outcome = call.outcome
        if isinstance(outcome, BusflowError):
            self.errors[type(outcome).__name__] += 1
        elif isinstance(outcome, BaseException):
            self.cancelled += 1
        else:
            self.answered += 1

    def _checked(self, request: Req | None) -> Req:
        asked = cast("Req", self.type.Request()) if request is None else request
        if type(asked) is not self.type.Request:
            given = type_name(type(asked)) if isinstance(asked, Message) else repr(asked)  # type: ignore[redundant-expr]  # users without a type checker
            raise IncompatibleType(
                f"{self.endpoint.origin} asks {self.service} with a {type_name(self.type.Request)}, not "
                f"{printable(given, limit=200)}"
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
        self._service = service
        service.clients.append(self)

    def close(self) -> None:
        """Leave the service."""
        if self._service is not None:
            service, self._service = self._service, None
            service.forget_client(self)

    def _attached(self) -> Service[Req, Res]:
        if self._service is None:
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
