"""WebSocketServer: listens at the port where viewers connect, checks each handshake, and prints what it refuses."""

from __future__ import annotations

import asyncio
import errno
import logging
import os
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from http import HTTPStatus
from typing import TYPE_CHECKING, Protocol

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.datastructures import MultipleValuesError
from websockets.typing import Subprotocol

from busflow.errors import InvalidInput, Problem
from busflow.text import printable
from busflow_ui import timeouts
from busflow_ui.foxglove.protocol import SUBPROTOCOLS

if TYPE_CHECKING:
    from ssl import SSLContext

    from websockets.http11 import Request, Response

_MOST_FRAME = 16 * 1024 * 1024
"""Largest message that a viewer may send."""
_MOST_REFUSED = 20
"""Most different refusals that are printed; a page could try with ever new ones."""

_LOG = logging.getLogger(__name__)
"""Log of websockets about failed handshakes; shown only where a program has asked for such lines."""
_LOG.addHandler(logging.NullHandler())
_LOG.propagate = False


class Admitting(Protocol):
    """Rule that accepts or refuses handshakes."""

    def refusal(self, host: str | None, origin: str | None) -> str | None:
        """Return why a handshake with these headers is refused; None if it is accepted."""
        ...


@dataclass(frozen=True, slots=True)
class Pages:
    """Answers to requests that are no WebSocket handshakes, and the headers of every answer."""

    answer: Callable[[ServerConnection, Request], Response | None] = lambda _connection, _request: None
    """Returns a page; None where the request is to become a WebSocket."""
    headers: Callable[[Request], Mapping[str, str]] = field(default=lambda _request: {})


class WebSocketServer:
    """Accepts connections at one port, from `open` until `close` returns."""

    def __init__(
        self,
        admission: Admitting,
        serve_one: Callable[[ServerConnection], Awaitable[None]],
        *,
        print_message: Callable[[str], None],
        pages: Pages | None = None,
        certificate: SSLContext | None = None,
    ) -> None:
        """Describe the server; `open` starts it.

        Args:
            admission: accepts or refuses each handshake.
            serve_one: serves a connection, until it is closed.
            print_message: prints a line for the person that started this.
            pages: what is served beside WebSockets.
            certificate: encrypts all connections.
        """
        self._admission, self._serve_one = admission, serve_one
        self._print, self._pages, self._certificate = print_message, pages or Pages(), certificate
        self._server: Server | None = None
        self._refused: set[str] = set()

    async def open(self, host: str, port: int) -> int:
        """Accept connections; return the port, a free one where 0 was asked for.

        Raises:
            InvalidInput: It cannot be had.
        """
        try:
            self._server = await serve(
                self._serve_one,
                host,
                port,
                subprotocols=[Subprotocol(each) for each in SUBPROTOCOLS],
                process_request=self._admit,
                process_response=self._add_headers,
                server_header=None,
                compression=None,  # on one machine it only costs time
                close_timeout=timeouts.current.closing,
                max_size=_MOST_FRAME,
                logger=_LOG,
                ssl=self._certificate,
            )
        except OSError as error:
            why = os.strerror(error.errno) if error.errno and error.errno > 0 else error.strerror or str(error)
            message = f"{host}:{port} cannot be listened at: {why}"
            fix = "say another one with --port, or 0 for a free one"
            if error.errno not in {errno.EADDRINUSE, errno.EACCES}:
                fix = "say an address of this machine with --host: 127.0.0.1, or 0.0.0.0 for all that it has"
            raise InvalidInput(Problem("address", message, fix)) from None
        return self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """Close all connections, without waiting for slow viewers."""
        if self._server is not None:
            self._server.close()
            with suppress(TimeoutError):
                async with asyncio.timeout(timeouts.current.closing):
                    await self._server.wait_closed()

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        try:
            host, origin = request.headers.get("Host"), request.headers.get("Origin")
        except MultipleValuesError:
            refusal = "a handshake has one Host and one Origin"
        else:
            refusal = self._admission.refusal(host, origin)
        if refusal is None:
            return self._pages.answer(connection, request)
        if refusal not in self._refused and len(self._refused) < _MOST_REFUSED:
            self._refused.add(refusal)
            self._print(f"warning: refused a connection: {refusal}")
        return connection.respond(HTTPStatus.FORBIDDEN, f"{printable(refusal)}\n")

    def _add_headers(self, _connection: ServerConnection, request: Request, response: Response) -> None:
        for name, value in self._pages.headers(request).items():
            response.headers[name] = value


def name_of(connection: ServerConnection) -> str:
    """Return a viewer's name for messages: its address, and its page if it is one."""
    host, port, *_ = connection.remote_address
    request = connection.request
    origin = request.headers.get("Origin") if request is not None else None
    return f"viewer {host}:{port}" + (f" ({origin})" if origin else "")
