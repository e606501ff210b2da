"""Service: a name, its type, who answers it now, and the way of a call from its client to its answer.

The wire meets local nodes here. To let somebody outside ask, it awaits `bus.services[name].call(request)`; to let
nodes ask somebody outside, it makes `bus.service(name, type, origin).join(answerer)`, and `leave` when that one goes.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from threading import get_ident
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from busflow.bus.call import Answerer, Asker, Call, Req, Res, current_activity, refuse_cycle
from busflow.bus.delivery import DeliverySource
from busflow.bus.expiry import NS_PER_S
from busflow.bus.statistics import ClientStatistics, ServerStatistics, ServiceStatistics
from busflow.errors import BusflowError, DuplicateServer, NotRunning, ServiceTimeout, ServiceUnavailable
from busflow.interfaces.message import ServiceType
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.clock import Clock

S = TypeVar("S", ServerStatistics, ClientStatistics)


class Service(DeliverySource, Generic[Req, Res]):
    """A name, its type, who answers it now, and who asks."""

    __slots__ = (
        "_calls", "_clock", "_gone_clients", "_gone_servers", "_known", "_on_leave", "_thread", "_waiting", "clients",
        "name", "server", "taps", "type",
    )  # fmt: skip

    def __init__(
        self,
        name: str,
        service_type: type[ServiceType],
        clock: Clock,
        known: Mapping[str, Service[Any, Any]],
        on_leave: Sequence[Callable[[Any], None]] = (),
    ) -> None:
        """A service that nobody answers yet.

        Args:
            name: Its final name.
            service_type: Its type.
            clock: What timeouts go by.
            known: All services of the bus by name: those that may have been meant, and those that may wait.
            on_leave: Who hears of each end of this process that leaves.
        """
        super().__init__()
        self.name = name
        self.type = service_type
        self.server: Answerer | None = None
        self.clients: list[Asker] = []
        self.taps: list[Callable[[Call[Req, Res]], None]] = []
        """Who hears of every call when it is made, and again when its outcome is known."""
        self._gone_servers: dict[str, ServerStatistics] = {}
        self._gone_clients: dict[str, ClientStatistics] = {}
        self._clock = clock
        self._known = known
        self._on_leave = on_leave
        self._waiting: list[asyncio.Future[None]] = []
        self._calls = 0
        self._thread = get_ident()

    async def call(self, request: Req, *, caller: str, timeout_s: float | None = None) -> Res:
        """Have a request answered, for a caller of any process.

        Args:
            request: A request of the service's type.
            caller: The full name of the node that asks.
            timeout_s: How long to wait, by the run's clock; None to wait as long as it takes.

        Raises:
            ServiceError: there is no answer, for one of its reasons.
            DeadlockError: the server waits for the one who asks.
        """
        if get_ident() != self._thread:
            raise NotRunning(f"a call of {self.name} must be awaited on the graph's own event loop")
        self._calls += 1
        call: Call[Req, Res] = Call(self.name, self._calls, request, caller, timeout_s)
        behalf = current_activity()
        for tap in self.taps:
            tap(call)
        limit = self._limit(call, timeout_s)
        if behalf is not None:
            behalf.calls.append(call)
        try:
            self._begin(call)
            return await call.reply
        finally:
            if behalf is not None:
                behalf.calls.remove(call)
            if limit is not None:
                limit.cancel()
            self._end(call)

    def _begin(self, call: Call[Req, Res]) -> None:
        """Hand a call to the server; where that cannot be, it has failed."""
        behalf = current_activity()
        try:
            if self.server is None:
                raise self._unavailable()
            if behalf is not None:
                refuse_cycle(self.name, self._answerer, behalf)
            self.server.accept(call)
        except BusflowError as error:
            call.fail(error)

    def _end(self, call: Call[Req, Res]) -> None:
        """A call is over: answered, failed, out of time, or its caller does not wait any more."""
        call.reply.cancel()
        # To ask for an outcome also says, to asyncio, that an error was not overlooked.
        if isinstance(call.outcome, BaseException) and self.server is not None:
            self.server.withdraw(call)
        for tap in self.taps:
            tap(call)

    def _limit(self, call: Call[Req, Res], timeout_s: float | None) -> asyncio.TimerHandle | None:
        if timeout_s is None:
            return None

        def expire() -> None:
            server = self.server.node if self.server else "nobody"
            call.fail(ServiceTimeout(f"{self.name} did not answer within {timeout_s:g} s (its server is {server})"))

        return self._clock.call_at(self._clock.monotonic_ns() + round(timeout_s * NS_PER_S), expire)

    def _answerer(self, name: str) -> Answerer | None:
        return self._known[name].server if name in self._known else None

    def _unavailable(self) -> ServiceUnavailable:
        if self._gone_servers:
            return ServiceUnavailable(
                f"nobody answers {self.name} any more: {next(iter(self._gone_servers))} has ended"
            )
        served = [each.name for each in self._known.values() if each.server is not None]
        return ServiceUnavailable(f"nobody answers {self.name}; {did_you_mean(self.name, served)}")

    async def wait_for_server(self, timeout_s: float | None) -> None:
        """Wait until somebody answers the service.

        Raises:
            ServiceUnavailable: nobody did in time.
        """
        if self.server is not None:
            return
        arrival = asyncio.get_running_loop().create_future()
        self._waiting.append(arrival)
        try:
            async with asyncio.timeout(timeout_s):
                await arrival
        except TimeoutError:
            raise self._unavailable() from None
        finally:
            self._waiting.remove(arrival)

    # Who comes and goes.

    def refuse_second(self, origin: str) -> None:
        """Refuse whoever else wants to answer.

        Raises:
            DuplicateServer: somebody does already.
        """
        if self.server is not None:
            raise DuplicateServer(
                f"{origin} cannot answer {self.name}, which {self.server.node} answers already; remap one of them"
            )

    def join(self, server: Answerer) -> None:
        """Let somebody answer from now on.

        Raises:
            DuplicateServer: somebody does already.
        """
        self.refuse_second(server.node)
        self.server = server
        for arrival in self._waiting:
            if not arrival.done():
                arrival.set_result(None)

    def leave(self, server: Answerer) -> None:
        """Let nobody answer any more; the calls it had taken are its own to fail."""
        self.server = None
        account = server.statistics()
        if account is not None:
            _enter(self._gone_servers, account)
            self._notify_left(server)

    def forget_client(self, client: Asker) -> None:
        """A client leaves; its account stays."""
        self.clients.remove(client)
        _enter(self._gone_clients, client.statistics())
        self._notify_left(client)

    def _notify_left(self, end: Any) -> None:
        for on_leave in self._on_leave:
            on_leave(end)

    def statistics(self) -> ServiceStatistics:
        """The accounts of both ends, as they stand now; one for all lives of a node, and for all its clients."""
        servers, clients = dict(self._gone_servers), dict(self._gone_clients)
        here = None if self.server is None else self.server.statistics()
        if here is not None:
            _enter(servers, here)
        for client in self.clients:
            _enter(clients, client.statistics())
        return ServiceStatistics(self.name, tuple(servers.values()), tuple(clients.values()))


def _enter(accounts: dict[str, S], account: S) -> None:
    """Add to the account of a node; there is one for each, however often it is started anew."""
    before = accounts.get(account.node)
    accounts[account.node] = account if before is None else before + account
