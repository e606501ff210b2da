"""Call: one request on its way to its answer, and who is held up by whom meanwhile.

Theory of operation. What a node is in the middle of, answering a request or its `start`, is an `Activity`. A task
finds its own in a context variable, so a call knows on whose behalf it is made, and every activity knows the calls it
waits for. Who a service is held up by is known as well: the activity that answers its current request. A new call
whose service is held up, through however many others, by the one who makes it could never be answered.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Generic, Protocol, TypeVar

from busflow.bus.statistics import ClientStatistics, ServerStatistics
from busflow.errors import BusflowError, DeadlockError
from busflow.interfaces.message import Message

Req = TypeVar("Req", bound=Message)
Res = TypeVar("Res", bound=Message)
Req_co = TypeVar("Req_co", bound=Message, covariant=True)
Res_co = TypeVar("Res_co", bound=Message, covariant=True)


class Pair(Protocol[Req_co, Res_co]):
    """What a type checker needs to see of a service type to know what a call takes and gives."""

    @property
    def Request(self) -> type[Req_co]: ...  # noqa: D102, N802  # the class inside a service type
    @property
    def Response(self) -> type[Res_co]: ...  # noqa: D102, N802  # the same


class Activity:
    """What a node is in the middle of and others may wait for: answering a request, or its `start`."""

    __slots__ = ("calls", "name")

    def __init__(self, name: str) -> None:
        self.name = name
        self.calls: list[Call[Any, Any]] = []
        """What it waits for now."""

    @contextmanager
    def current(self) -> Generator[None]:
        """Let every call that is made inside, also by tasks that begin there, be on behalf of this activity."""
        token = _CURRENT.set(self)
        try:
            yield
        finally:
            _CURRENT.reset(token)


_CURRENT: ContextVar[Activity | None] = ContextVar("busflow.activity", default=None)


def current_activity() -> Activity | None:
    """On whose behalf the running code works; what is over by now holds nobody up."""
    return _CURRENT.get()


def detach_activity() -> None:
    """Let this task be one that nobody waits for, whoever began it."""
    _CURRENT.set(None)


class Answerer(Protocol):
    """Who answers the calls of a service: a node's server, or what stands here for one in another process."""

    @property
    def node(self) -> str:
        """The full name of its node."""
        ...

    @property
    def holder(self) -> Activity | None:
        """What has to end before the next call is taken, as far as is known here."""
        ...

    def accept(self, call: Call[Any, Any]) -> None:
        """Take a call, and sooner or later `succeed` or `fail` it.

        Raises:
            ServiceUnavailable: there is no room for it.
        """
        ...

    def withdraw(self, call: Call[Any, Any]) -> None:
        """Learn that nobody waits for the answer any more; asked for every call that ends without one."""
        ...

    def statistics(self) -> ServerStatistics | None:
        """Its account; None of what stands in for a server, which has its own."""
        ...


class Asker(Protocol):
    """Who makes the calls of a service: a node's client."""

    def statistics(self) -> ClientStatistics:
        """Its account."""
        ...


class Call(Generic[Req, Res]):
    """One request, and the answer to come."""

    __slots__ = ("activity", "caller", "limit_s", "number", "reply", "request", "service")

    def __init__(self, service: str, number: int, request: Req, caller: str, limit_s: float | None = None) -> None:
        """A call that is to be made on the running loop.

        Args:
            service: its name.
            number: counts those of the service.
            request: what is asked.
            caller: who asks.
            limit_s: how long the caller will wait from now on; None for as long as it takes.
        """
        self.service = service
        self.number = number
        self.request = request
        self.caller = caller
        self.limit_s = limit_s
        self.activity = Activity(service)
        """Its being answered."""
        self.reply: asyncio.Future[Res] = asyncio.get_running_loop().create_future()

    def succeed(self, response: Res) -> None:
        """Give the answer; a caller that has gone does not get it."""
        if not self.reply.done():
            self.reply.set_result(response)

    def fail(self, error: BusflowError) -> None:
        """Let the caller's `await` raise."""
        if not self.reply.done():
            self.reply.set_exception(error)

    @property
    def outcome(self) -> Res | BaseException | None:
        """The answer, or why there is none; None as long as that is open."""
        if not self.reply.done():
            return None
        if self.reply.cancelled():
            return asyncio.CancelledError()
        return self.reply.exception() or self.reply.result()


def refuse_cycle(name: str, answerer: Callable[[str], Answerer | None], waiting: Activity) -> None:
    """Refuse that an activity waits for a service that waits for it.

    Args:
        name: The service.
        answerer: Who answers a service, by its name.
        waiting: Who would wait for it.

    Raises:
        DeadlockError: naming the chain.
    """
    chain = _chain(name, answerer, waiting, set())
    if chain is not None:
        steps = ", which waits for ".join(chain)
        raise DeadlockError(
            f"{waiting.name} waits for {steps}: none of them could ever go on; answer first, and let self.spawn(…) "
            "do what may come later"
        )


def _chain(
    name: str, answerer: Callable[[str], Answerer | None], waiting: Activity, seen: set[str]
) -> list[str] | None:
    """The names from a service to the one who waits for it, if it is held up by that one."""
    server = None if name in seen else answerer(name)
    seen.add(name)
    holder = None if server is None else server.holder
    if holder is None:
        return None
    names = [name] if holder.name == name else [name, holder.name]
    if holder is waiting:
        return names
    for call in holder.calls:
        found = _chain(call.service, answerer, waiting, seen)
        if found is not None:
            return names + found
    return None
