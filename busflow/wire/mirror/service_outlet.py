"""ServiceOutlet: lets other processes call a server of this one, as `rmw_zenoh` does.

A request is a query on the service's key; the answer has the same attachment. ROS 2 has no error answer: busflow sends
Zenoh's error reply, a JSON object with `kind` and `error`.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import asyncio
import threading
from collections.abc import Awaitable, Callable, Iterable
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh

from busflow.errors import BusflowError, ServiceTimeout, ServiceUnavailable
from busflow.interfaces.message import Message, ServiceType
from busflow.wire.mirror.connection import decoded
from busflow.wire.queries.server import replying
from busflow.wire.zenoh.keys import PATIENCE
from busflow.wire.zenoh.refusal import encode_refusal

if TYPE_CHECKING:
    from busflow.wire.mirror.connection import Connection

_AT_ONCE = 1000
"""Limit of the requests in progress, and of those that wait for the loop; the server's own queue refuses first."""


class ServiceOutlet:
    """Passes requests of other processes to a local server, and sends back its answers."""

    def __init__(
        self,
        name: str,
        service_type: type[ServiceType],
        answer: Callable[[Any], Awaitable[Message]],
        keys: Iterable[str],
        connection: Connection,
    ) -> None:
        """Start to answer the requests under these keys."""
        self._name, self._answer, self._sender = name, answer, connection.replier
        self._request, self._response = map(connection.supports, (service_type.Request, service_type.Response))
        self._tasks: set[asyncio.Task[None]] = set()
        self._room = threading.Semaphore(_AT_ONCE)

        def on_query(query: zenoh.Query) -> None:
            if self._room.acquire(blocking=False):
                connection.on_loop(self._begin, query)
            else:
                query.drop()  # so its client gets no answer, as from a server that has gone

        callback: Any = zenoh.handlers.Callback(on_query, indirect=False)
        self._queryables = [connection.session.declare_queryable(key, callback, complete=True) for key in keys]

    def close(self) -> None:
        """Stop answering; waiting clients get an error."""
        for queryable in self._queryables:
            queryable.undeclare()
        for task in self._tasks:
            task.cancel()

    def _begin(self, query: zenoh.Query) -> None:
        self._room.release()
        if len(self._tasks) >= _AT_ONCE:
            self._refuse(query, ServiceUnavailable(f"{_AT_ONCE} requests of {self._name} wait for answers already"))
            return
        task = asyncio.get_running_loop().create_task(self._serve(query), name=f"busflow.{self._name}")
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _serve(self, query: zenoh.Query) -> None:
        try:
            request = decoded(query.payload or zenoh.ZBytes(b""), self._request)
            response, remark = await self._in_time(query, request)
            answer = self._response.encode(response)
        except BusflowError as error:
            self._refuse(query, error)
        else:
            attachment = None if query.attachment is None else query.attachment.to_bytes() + remark.encode()
            self._sender.hand(partial(_reply, query, answer, attachment), len(answer))

    async def _ask(self, query: zenoh.Query, request: Message) -> tuple[Message, str]:  # noqa: ARG002  # for subclasses
        """Return the answer, and a remark that only busflow's clients can read."""
        return await self._answer(request), ""

    async def _in_time(self, query: zenoh.Query, request: Message) -> tuple[Message, str]:
        """Return the answer. If the client's time limit passes first, a request that still waits is withdrawn.

        Raises:
            ServiceError: there is no answer, or none in time.
        """
        timeout_s = _timeout_s(query)
        try:
            async with asyncio.timeout(timeout_s):
                return await self._ask(query, request)
        except TimeoutError as error:
            if isinstance(error, BusflowError):
                raise
            raise ServiceTimeout(f"{self._name} did not answer within {timeout_s:g} s") from None

    def _refuse(self, query: zenoh.Query, error: BusflowError) -> None:
        self._sender.hand(partial(_reply_error, query, encode_refusal(error)))


def _timeout_s(query: zenoh.Query) -> float | None:
    """Return the client's time limit; None if it states none, as ROS 2's clients."""
    try:
        return float(query.parameters.get(PATIENCE) or "")
    except ValueError:
        return None


def _reply(query: zenoh.Query, payload: bytes, attachment: bytes | None) -> None:
    with replying(query):
        query.reply(query.key_expr, payload, attachment=attachment)


def _reply_error(query: zenoh.Query, text: bytes) -> None:
    with replying(query):
        query.reply_err(text)
