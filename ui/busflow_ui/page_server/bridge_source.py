"""BridgeSource: another server of Foxglove's protocol, such as ROS 2's foxglove_bridge, passed on to pages."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager, suppress
from typing import TYPE_CHECKING, Any, cast

from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidHandshake, InvalidURI
from websockets.frames import CloseCode
from websockets.typing import Subprotocol

import busflow
from busflow.clock import SystemClock
from busflow.errors import BusflowError, InspectionUnavailable, InvalidInput, Problem
from busflow.text import printable
from busflow_ui import timeouts
from busflow_ui.foxglove import protocol
from busflow_ui.foxglove.protocol import Level
from busflow_ui.page_server.access import Access
from busflow_ui.questions import frames
from busflow_ui.questions.session import Session

if TYPE_CHECKING:
    from websockets.asyncio.server import ServerConnection

_MOST_FRAME = 64 * 1024 * 1024
"""Largest message that is passed on: an image, or a point cloud."""
_HARMLESS = (
    *(protocol.Subscribe, protocol.Unsubscribe, protocol.GetParameters),
    *(protocol.FollowParameters, protocol.FollowGraph),
)
"""Requests of a page that may only look."""
_STEERING = {"clientPublish", "services", "assets"}
"""Capabilities that such a page is not offered."""


class BridgeSource:
    """Server at another address. Each page has a connection of its own there, which reads only as fast as the page."""

    def __init__(self, url: str, *, print_message: Callable[[str], None]) -> None:
        """Name a server.

        Raises:
            InvalidInput: The address is none of a WebSocket.
        """
        if not url.startswith(("ws://", "wss://")):
            fix = "write it as foxglove_bridge prints it: ws://robot:8765"
            raise InvalidInput(Problem("address", f"{printable(url)} is no address of a WebSocket", fix))
        self._url, self._print = url, print_message
        self._clock = SystemClock()

    async def check(self) -> None:
        """Connect once, so that a wrong address is noticed at the start.

        Raises:
            InspectionUnavailable: Nothing that speaks the protocol answers there.
        """
        async with self._connected():
            pass

    async def serve(self, connection: ServerConnection, access: Access) -> None:
        """Serve a page that has been let in; it is connected again where the other server comes back."""
        if access is Access.ASK:
            await connection.close(CloseCode.POLICY_VIOLATION, "what is shown here has no assistant")
            return
        while True:
            try:
                async with self._connected() as upstream:
                    await self._relay(connection, upstream, access)
                    return
            except InspectionUnavailable as error:
                with suppress(ConnectionClosed):
                    lost = {"name": self._url, "ended": {"reason": str(error)}}
                    await connection.send(frames.update("run", lost))
            with suppress(TimeoutError):
                async with asyncio.timeout(timeouts.current.reconnection):
                    await connection.wait_closed()
                    return

    @asynccontextmanager
    async def _connected(self) -> AsyncGenerator[ClientConnection]:
        names = [Subprotocol(each) for each in protocol.SUBPROTOCOLS]
        options: dict[str, Any] = {
            "compression": None,
            "max_size": _MOST_FRAME,
            "open_timeout": timeouts.current.connection,
        }
        try:
            upstream = await connect(self._url, subprotocols=names, proxy=None, **options)
        except (OSError, TimeoutError, InvalidHandshake, InvalidURI) as error:
            why = printable(error) or "it does not answer"
            raise InspectionUnavailable(f"{printable(self._url)} cannot be reached: {why}") from None
        async with upstream:
            yield upstream

    async def _relay(self, page: ServerConnection, upstream: ClientConnection, access: Access) -> None:
        """Pass messages on until the page ends its connection.

        Raises:
            InspectionUnavailable: The other server has ended its one.
        """
        both = [
            asyncio.create_task(self._to_page(page, upstream, access)),
            asyncio.create_task(self._from_page(page, upstream, access)),
        ]
        try:
            done, _ = await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in both:
                task.cancel()
        for task in done:
            task.result()
        if both[1] not in done:
            raise InspectionUnavailable(f"{printable(self._url)} has ended the connection")

    async def _to_page(self, page: ServerConnection, upstream: ClientConnection, access: Access) -> None:
        with suppress(ConnectionClosed):
            async for message in upstream:
                await page.send(_greeting(message, access) if isinstance(message, str) else message)

    async def _from_page(self, page: ServerConnection, upstream: ClientConnection, access: Access) -> None:
        def send(message: str) -> None:
            tasks.create_task(page.send(message))

        session = Session({}, send, read_only=True, print_message=self._print)
        with suppress(ConnectionClosed):
            async with asyncio.TaskGroup() as tasks:
                async for message in page:
                    try:
                        if not session.take(message):
                            _require_allowed(message, access)
                            await upstream.send(message)
                    except BusflowError as error:
                        send(protocol.status(Level.ERROR, printable(error)))


def _require_allowed(message: str | bytes, access: Access) -> None:
    """Refuse what a page that may only look is not allowed; others may send what is no message of ours, too."""
    if access is Access.READ_ONLY and not isinstance(protocol.read(message), _HARMLESS):
        raise InspectionUnavailable("this page may only look")


def _greeting(message: str, access: Access) -> str:
    """Return the other server's greeting with what the page is to know; any other message as it is."""
    if '"serverInfo"' not in message:
        return message
    try:
        found = json.loads(message)
    except (ValueError, RecursionError):
        return message
    fields = cast("dict[str, Any]", found) if isinstance(found, dict) else {}
    if fields.get("op") != "serverInfo":
        return message
    offered = [str(each) for each in fields.get("capabilities") or ()]
    own = {"busflow": busflow.__version__, "source": "bridge", "access": access}
    fields["capabilities"] = [each for each in offered if access is Access.CONTROL or each not in _STEERING]
    fields["metadata"] = {**(fields.get("metadata") or {}), **own}
    return json.dumps(fields)
