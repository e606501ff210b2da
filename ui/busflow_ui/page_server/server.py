"""PageServer: serves the page and lets its browsers in: a token first, then what they look at."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode

from busflow.errors import MalformedMessage
from busflow_ui import timeouts
from busflow_ui.foxglove.websocket_server import Pages, WebSocketServer, name_of
from busflow_ui.questions import frames

if TYPE_CHECKING:
    from ssl import SSLContext

    from websockets.asyncio.server import ServerConnection

    from busflow_ui.page_server.access import Access, PageAdmission, Tokens
    from busflow_ui.page_server.files import PageFiles

_MOST_STRANGERS = 16
"""Most connections without a token, fewer than a run may have viewers: strangers keep few pages out."""
WRONG_TOKEN = 4401
"""Close code of a connection whose token is wrong."""


class Source(Protocol):
    """What pages look at: a run, a recording, or another server of the protocol."""

    async def serve(self, connection: ServerConnection, access: Access) -> None:
        """Serve a page that has been let in, until either side ends the connection."""
        ...


class PageServer:
    """Serves the page at one port, from `open` until `close` returns."""

    def __init__(
        self,
        source: Source,
        *,
        admission: PageAdmission,
        tokens: Tokens,
        files: PageFiles,
        print_message: Callable[[str], None],
        certificate: SSLContext | None = None,
    ) -> None:
        self._source, self._admission, self._tokens, self._print = source, admission, tokens, print_message
        pages = Pages(files.answer, files.headers)
        self._server = WebSocketServer(
            admission, self._serve, print_message=print_message, pages=pages, certificate=certificate
        )
        self._strangers = asyncio.Semaphore(_MOST_STRANGERS)

    async def open(self, host: str, port: int) -> int:
        """Accept browsers; return the port, a free one where 0 was asked for.

        Raises:
            InvalidInput: It cannot be had.
        """
        return await self._server.open(host, port)

    async def close(self) -> None:
        """Close all connections, without waiting for slow browsers."""
        await self._server.close()

    async def _serve(self, connection: ServerConnection) -> None:
        if self._strangers.locked():
            await connection.close(CloseCode.TRY_AGAIN_LATER, f"{_MOST_STRANGERS} connections have sent no token")
            return
        async with self._strangers:
            access = await self._access(connection)
        if access is None:
            self._print(f"warning: {name_of(connection)} was refused: its token is wrong")
            await connection.close(
                WRONG_TOKEN, "the token is wrong or missing: open the address that busflow ui prints"
            )
            return
        await self._source.serve(connection, access)

    async def _access(self, connection: ServerConnection) -> Access | None:
        """Wait for the first message; return the rights that its token gives."""
        try:
            async with asyncio.timeout(timeouts.current.hello):
                message = await connection.recv()
            frame = frames.read(message)
        except (TimeoutError, ConnectionClosed, MalformedMessage):
            return None
        request = connection.request
        if not isinstance(frame, frames.Hello) or request is None:
            return None
        host, origin = request.headers.get("Host"), request.headers.get("Origin")
        return self._tokens.access(frame.token, is_foreign=self._admission.is_foreign(host, origin))
