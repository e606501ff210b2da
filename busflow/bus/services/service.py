"""Service: a name, its type, its server, and the steps of a call from its client to its answer.

The wire connects to local nodes here. For a remote caller it awaits `bus.services[name].call(request)`. For a remote
server it calls `bus.service(name, type, origin).join(answerer)`, and `leave` when that server ends.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from threading import get_ident
from typing import Any, Generic, TypeVar, cast

from busflow.bus.delivery import DeliverySource
from busflow.bus.services.call import Answerer, Asker, Call, Req, Res, current_activity, refuse_cycle, waited
from busflow.bus.statistics import ClientStatistics, ServerStatistics, ServiceStatistics
from busflow.clock import NS_PER_S, Clock
from busflow.errors import BusflowError, DuplicateServer, NotRunning, ServiceTimeout, ServiceUnavailable
from busflow.interfaces.message import ServiceType, type_name
from busflow.text import did_you_mean

S = TypeVar("S", ServerStatistics, ClientStatistics)


class Service(DeliverySource, Generic[Req, Res]):
    """A name, its type, its current server and its clients."""

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
        on_leave: Callable[[Answerer | Asker], object],
    ) -> None:
        """Create a service without a server.

        Args:
            name: Its final name.
            service_type: Its type.
            clock: The clock of timeouts.
            known: All services of the bus by name, for suggestions and the search for deadlocks.
            on_leave: Called with each local client or server that leaves.
        """
        super().__init__()
        self.name: str = name
        self.type: type[ServiceType] = service_type
        self.server: Answerer | None = None
        self.clients: list[Asker] = []
        self.taps: list[Callable[[Call[Req, Res]], None]] = []
        """Called with every call when it is made, and again when its outcome is known."""
        self._gone_servers: dict[str, ServerStatistics] = {}
        self._gone_clients: dict[str, ClientStatistics] = {}
        self._clock = clock
        self._known = known
        self._on_leave = on_leave
        self._waiting: list[asyncio.Future[None]] = []
        self._calls = 0
        self._thread = get_ident()

    async def call(self, request: Req, *, caller: str, timeout_s: float | None = None) -> Res:
        """Send a request to the server, for a caller of any process, and return the answer.

        Args:
            request: A request of the service's type.
            caller: The full name of the calling node.
            timeout_s: Seconds of the run's clock; None for no limit.

        Raises:
            ServiceError: there is no answer, for one of its reasons.
            DeadlockError: the server waits for the caller.
        """
        call = self.begin(request, caller=caller, timeout_s=timeout_s)
        try:
            return await waited(call, call.reply)
        finally:
            self.end(call)

    def begin(self, request: Req, *, caller: str, timeout_s: float | None = None) -> Call[Req, Res]:
        """Pass a request to the server, and return its call, which `end` must follow; what `call` raises is its reply.

        Raises:
            NotRunning: it is another thread than the graph's.
        """
        if get_ident() != self._thread:
            raise NotRunning(f"a call of {self.name} must be awaited on the graph's own event loop")
        self._calls += 1
        call: Call[Req, Res] = Call(self.name, self._calls, request, caller, timeout_s)
        for tap in self.taps:
            tap(call)
        if timeout_s is not None:
            self._limit(call, timeout_s)
        try:
            if self.server is None:
                raise self._unavailable()
            self.refuse_cycle(call)
            self.server.accept(call)
        except BusflowError as error:
            call.fail(error)
        return call

    def refuse_cycle(self, call: Call[Req, Res]) -> None:
        """Refuse to let the running activity wait for a call that waits for that activity.

        Raises:
            DeadlockError: naming the chain.
        """
        behalf = current_activity()
        if behalf is not None:
            refuse_cycle(call, self._answerer, behalf)

    def end(self, call: Call[Req, Res]) -> Res | BaseException:
        """Clean up a call that was answered, has failed, or has lost its caller, and return its outcome."""
        if call.expiry is not None:
            call.expiry.cancel()
        call.reply.cancel()
        outcome = call.outcome  # which also marks an exception as retrieved for asyncio
        if isinstance(outcome, BaseException) and self.server is not None:
            self.server.withdraw(call)
        for tap in self.taps:
            tap(call)
        return cast("Res | BaseException", outcome)

    def _limit(self, call: Call[Req, Res], timeout_s: float) -> None:
        def expire() -> None:
            server = self.server.node if self.server else "gone"
            call.fail(ServiceTimeout(f"{self.name} did not answer within {timeout_s:g} s (its server is {server})"))

        call.expiry = self._clock.call_at(self._clock.monotonic_ns() + round(timeout_s * NS_PER_S), expire)

    def _answerer(self, name: str) -> Answerer | None:
        return self._known[name].server if name in self._known else None

    def _unavailable(self) -> ServiceUnavailable:
        if self._gone_servers:
            return ServiceUnavailable(f"{self.name} has no server any more: {next(iter(self._gone_servers))} has ended")
        served = [each.name for each in self._known.values() if each.server is not None]
        advice = did_you_mean(self.name, served, none="start a node that answers it")
        return ServiceUnavailable(f"{self.name} has no server; {advice}")

    async def wait_for_server(self, timeout_s: float | None) -> None:
        """Wait until the service has a server.

        Raises:
            ServiceUnavailable: no server came in time.
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

    # Servers and clients that come and go.

    def refuse_second(self, origin: str) -> None:
        """Refuse a second server.

        Raises:
            DuplicateServer: the service has a server.
        """
        if self.server is not None:
            raise DuplicateServer(
                f"{origin} cannot answer {self.name}, which {self.server.node} answers already; remap one of them"
            )

    def join(self, server: Answerer) -> None:
        """Set the server, and wake all that wait for one.

        Raises:
            DuplicateServer: the service has a server.
        """
        self.refuse_second(server.node)
        self.server = server
        for arrival in self._waiting:
            if not arrival.done():
                arrival.set_result(None)

    def leave(self, server: Answerer) -> None:
        """Remove the server; it fails the calls it has taken itself."""
        self.server = None
        account = server.statistics()
        if account is not None:
            _enter(self._gone_servers, account)
            self._on_leave(server)

    def forget_client(self, client: Asker) -> None:
        """Remove a client; its counts stay."""
        self.clients.remove(client)
        _enter(self._gone_clients, client.statistics())
        self._on_leave(client)

    def statistics(self) -> ServiceStatistics:
        """Return the current counts of servers and clients, one each per node over all its starts."""
        servers, clients = dict(self._gone_servers), dict(self._gone_clients)
        here = None if self.server is None else self.server.statistics()
        if here is not None:
            _enter(servers, here)
        for client in self.clients:
            _enter(clients, client.statistics())
        return ServiceStatistics(self.name, type_name(self.type), tuple(servers.values()), tuple(clients.values()))


def _enter(accounts: dict[str, S], account: S) -> None:
    """Add to the counts of a node; it keeps one entry over all its starts."""
    before = accounts.get(account.node)
    accounts[account.node] = account if before is None else before + account
