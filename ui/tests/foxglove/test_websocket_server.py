"""The port at which viewers connect, without a run behind it."""

import asyncio
import http.client
import socket
from collections.abc import Awaitable, Callable
from http import HTTPStatus
from typing import Any

import pytest
from websockets.asyncio.server import ServerConnection

from busflow.errors import InvalidInput
from busflow_ui.foxglove.admission import Admission
from busflow_ui.foxglove.websocket_server import Pages, WebSocketServer
from tests.golden import Golden

PATIENCE_S = 60.0


async def served(_connection: ServerConnection) -> None:
    """Serve nothing."""


def behind(server: WebSocketServer, look: Callable[[int], object], host: str = "127.0.0.1", port: int = 0) -> None:
    """Call a function with the port, in a thread, while the server is open."""

    async def main() -> None:
        try:
            async with asyncio.timeout(PATIENCE_S):
                await asyncio.to_thread(look, await server.open(host, port))
        finally:
            await server.close()

    asyncio.run(main())


def get(port: int, *hosts: str) -> tuple[int, bytes, Any]:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
    connection.putrequest("GET", "/", skip_host=True)
    for host in hosts:
        connection.putheader("Host", host)
    connection.endheaders()
    response = connection.getresponse()
    found = response.status, response.read(), response.headers
    connection.close()
    return found


def test_requests_for_pages_are_answered_with_headers():
    pages = Pages(
        lambda connection, _: connection.respond(HTTPStatus.OK, "hello"), lambda request: {"X-Path": request.path}
    )
    server = WebSocketServer(Admission("127.0.0.1"), served, print_message=print, pages=pages)

    def look(port: int) -> None:
        status, body, headers = get(port, "localhost")
        assert (status, body, headers["X-Path"]) == (200, b"hello", "/")

    behind(server, look)


def test_a_handshake_has_one_host(capsys: pytest.CaptureFixture[str]):
    server = WebSocketServer(Admission("127.0.0.1"), served, print_message=print)

    def look(port: int) -> None:
        for _ in range(2):
            status, body, _headers = get(port, "localhost", "localhost")
            assert (status, body) == (403, b"a handshake has one Host and one Origin\n")
        assert get(port, "evil.example")[0] == 403

    behind(server, look)
    assert capsys.readouterr().out.count("warning: refused a connection") == 2


@pytest.mark.parametrize("host", ["127.0.0.1", "192.0.2.1"])
def test_an_address_that_cannot_be_had_is_named(host: str, golden: Golden):
    with socket.create_server(("127.0.0.1", 0)) as taken:
        server: Any = WebSocketServer(Admission(host), served, print_message=print)
        nothing: Callable[[int], Awaitable[None] | None] = lambda _: None  # noqa: E731  # short
        with golden.raises(InvalidInput, mask={r":\d+": ":PORT"}) as caught:
            behind(server, nothing, host, taken.getsockname()[1])
        assert caught.value.code == "address"
