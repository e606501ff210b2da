"""A viewer whose server makes a mistake: it is let go and the mistake is heard of, rather than left without a word."""

import asyncio
import struct
from types import SimpleNamespace
from typing import Any

import pytest
from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed

from busflow_ui.foxglove.viewer import Viewer

PATIENCE_S = 60.0
CALL = struct.pack("<BIII", 2, 1, 7, 3) + b"cdr"


class Broken:
    """Services that nobody can look up."""

    def get(self, number: int) -> None:
        raise RuntimeError(f"no number {number}")


def test_a_bug_in_a_call_ends_the_connection():
    run: Any = SimpleNamespace(peer=None, catalogue=SimpleNamespace(services=Broken()))

    async def main() -> None:
        ended: asyncio.Future[BaseException | None] = asyncio.get_running_loop().create_future()

        async def handle(connection: ServerConnection) -> None:
            try:
                await Viewer(connection, run, read_only=False).serve()
            except Exception as error:  # noqa: BLE001  # whatever it is, the test looks at it
                ended.set_result(error)
            else:
                ended.set_result(None)

        async with asyncio.timeout(PATIENCE_S), serve(handle, "127.0.0.1", 0) as server:
            port = server.sockets[0].getsockname()[1]
            async with connect(f"ws://127.0.0.1:{port}") as client:
                await client.send(CALL)
                with pytest.raises(ConnectionClosed):
                    await client.recv()
            error = await ended
        assert isinstance(error, ExceptionGroup)
        assert "no number 1" in repr(error)

    asyncio.run(main())
