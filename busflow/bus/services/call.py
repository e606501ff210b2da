"""Call: one request and its future answer, and the check for calls that wait for each other.

Theory of operation. An `Activity` is a node's `start`, or its answering of one request. A task finds its activity in a
context variable, so each call knows the activity that makes it, and each activity knows the calls it waits for. A
service knows the activity that answers its current request. If that activity waits, directly or through others, for the
activity that makes a new call to this service, the new call could never be answered, so it is refused.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Generator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, Generic, Protocol, TypeVar

from busflow.bus.statistics import ClientStatistics, ServerStatistics
from busflow.errors import BusflowError, DeadlockError
from busflow.interfaces.message import Message

Req = TypeVar("Req", bound=Message)
Res = TypeVar("Res", bound=Message)
T = TypeVar("T")
Req_co = TypeVar("Req_co", bound=Message, covariant=True)
Res_co = TypeVar("Res_co", bound=Message, covariant=True)


class Pair(Protocol[Req_co, Res_co]):
    """The request and response types of a service type, for type checkers."""

    @property
    def Request(self) -> type[Req_co]: ...  # noqa: D102, N802  # the class inside a service type
    @property
    def Response(self) -> type[Res_co]: ...  # noqa: D102, N802  # the same


class Activity:
    """A unit of a node's work that others may wait for: answering a request, or its `start`."""

    __slots__ = ("calls", "name")

    def __init__(self, name: str) -> None:
        self.name: str = name
        self.calls: list[Call[Any, Any]] = []
        """The calls it waits for now."""

    @contextmanager
    def current(self) -> Generator[None]:
        """Attribute every call made inside, and by tasks created inside, to this activity."""
        token = _CURRENT.set(self)
        try:
            yield
        finally:
            _CURRENT.reset(token)


_CURRENT: ContextVar[Activity | None] = ContextVar("busflow.activity", default=None)


def current_activity() -> Activity | None:
    """Return the activity of the running code; a finished one delays no other."""
    return _CURRENT.get()


def set_activity(activity: Activity | None) -> None:
    """Attribute every call that this task makes from now on to an activity, or to none."""
    _CURRENT.set(activity)


class Answerer(Protocol):
    """The receiver of a service's calls: a node's server, or the local stand-in for a remote one."""

    @property
    def node(self) -> str:
        """The full name of its node."""
        ...

    def holder(self, call: Call[Any, Any]) -> Activity | None:
        """Return the activity that must end before a call is answered, if known in this process."""
        ...

    def accept(self, call: Call[Any, Any]) -> None:
        """Take a call, and sooner or later `succeed` or `fail` it.

        Raises:
            ServiceUnavailable: there is no room for it.
        """
        ...

    def withdraw(self, call: Call[Any, Any]) -> None:
        """Drop a call whose caller no longer waits; called for every call that ends without an answer."""
        ...

    def statistics(self) -> ServerStatistics | None:
        """Return its counts; None for a stand-in, whose server has its own."""
        ...


class Asker(Protocol):
    """The sender of a service's calls: a node's client."""

    def statistics(self) -> ClientStatistics:
        """Return its counts."""
        ...


class Call(Generic[Req, Res]):
    """One request, and the answer to come."""

    __slots__ = (
        "activity", "caller", "expiry", "feedback_count", "limit_s", "number", "remark", "reply", "request", "service",
    )  # fmt: skip

    def __init__(self, service: str, number: int, request: Req, caller: str, limit_s: float | None = None) -> None:
        """Create a call on the running loop.

        Args:
            service: the service's name.
            number: the call's number within the service.
            request: the request.
            caller: the full name of the calling node.
            limit_s: how long the caller will wait from now on; None for no limit.
        """
        self.service: str = service
        self.number: int = number
        self.request: Req = request
        self.caller: str = caller
        self.limit_s: float | None = limit_s
        self.activity: Activity = Activity(service)
        """The server's activity of answering it."""
        self.remark: str = ""
        """What the server says beside its answer, for people; ROS 2's services have no place for it."""
        self.feedback_count: int = 0
        """How many messages of an action's feedback precede its answer, if they come another way: between processes."""
        self.expiry: asyncio.TimerHandle | None = None
        """The timer of its limit."""
        self.reply: asyncio.Future[Res] = asyncio.get_running_loop().create_future()

    def succeed(self, response: Res) -> None:
        """Set the answer; it is ignored if the caller no longer waits."""
        if not self.reply.done():
            self.reply.set_result(response)

    def fail(self, error: BusflowError) -> None:
        """Make the caller's `await` raise."""
        if not self.reply.done():
            self.reply.set_exception(error)

    @property
    def outcome(self) -> Res | BaseException | None:
        """The answer or the exception; None while the call is open."""
        if not self.reply.done():
            return None
        return asyncio.CancelledError() if self.reply.cancelled() else self.reply.exception() or self.reply.result()


async def waited(call: Call[Any, Any], future: Awaitable[T]) -> T:
    """Wait for what a call leads to; the running activity then waits for that call."""
    behalf = current_activity()
    if behalf is None:
        return await future
    behalf.calls.append(call)
    try:
        return await future
    finally:
        behalf.calls.remove(call)


def refuse_cycle(call: Call[Any, Any], answerer: Callable[[str], Answerer | None], waiting: Activity) -> None:
    """Refuse a call by an activity to a service that waits for that activity.

    Args:
        call: The call.
        answerer: Returns the server of a service, by its name.
        waiting: The activity that makes the call.

    Raises:
        DeadlockError: naming the chain.
    """
    chain = _chain(call, answerer, waiting, set())
    if chain is not None:
        steps = ", which waits for ".join(chain)
        raise DeadlockError(
            f"{waiting.name} waits for {steps}: none of them could ever go on; answer first, and let self.spawn(…) "
            "do what may come later"
        )


def _chain(
    call: Call[Any, Any], answerer: Callable[[str], Answerer | None], waiting: Activity, seen: set[Activity]
) -> list[str] | None:
    """Return the names from the service of a call to the waiting activity, if the call waits for it."""
    server = answerer(call.service)
    holder = None if server is None else server.holder(call)
    if holder is None or holder in seen:
        return None
    seen.add(holder)
    names = [call.service] if holder.name == call.service else [call.service, holder.name]
    if holder is waiting:
        return names
    for each in holder.calls:
        found = _chain(each, answerer, waiting, seen)
        if found is not None:
            return names + found
    return None
