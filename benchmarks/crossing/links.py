"""Links: the ways from process to process that are not busflow's. Each has a sender's and a receiver's part.

`python -m benchmarks.crossing.links NAME FOLDER SIZE` is the receiver; the sender is whoever measures.
"""

from __future__ import annotations

import asyncio
import json
import os
import socket
import struct
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from multiprocessing.shared_memory import SharedMemory
from pathlib import Path
from typing import Any

from benchmarks.crossing import WINDOWS
from benchmarks.crossing.board import Board

Take = Callable[[int], None]
POLL_S = 0.05


class Zenoh:
    """Raw Zenoh over a unix socket, with the receive buffer that busflow gives it, and a callback as is its default."""

    indirect = True
    """Whether the callback has a thread of its own, or is called by the one that reads the link."""

    def __init__(self, folder: Path, _size: int) -> None:
        self._socket = f"unixsock-stream/{folder / 'z.sock'}"

    def _open(self, *, listen: bool) -> Any:
        import zenoh

        settings = {
            "mode": "peer",
            "listen/endpoints": [self._socket] if listen else [],
            "connect/endpoints": [] if listen else [self._socket],
            "scouting/multicast/enabled": False,
            "transport/link/rx/buffer_size": 1 << 20,
            "transport/shared_memory/enabled": False,
        }
        config = zenoh.Config()
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
        return zenoh.open(config)

    @asynccontextmanager
    async def sender(self) -> AsyncIterator[Callable[[bytes], object]]:
        import zenoh

        with self._open(listen=True) as session:
            publisher = session.declare_publisher("t", congestion_control=zenoh.CongestionControl.BLOCK)
            yield publisher.put

    def receive(self, take: Take, board: Board) -> None:
        import zenoh

        def hear(sample: Any) -> None:
            take(sample.payload.to_bytes()[0])

        with self._open(listen=False) as session:
            session.declare_subscriber("t", zenoh.handlers.Callback(hear, indirect=self.indirect))
            while not board.done:
                time.sleep(POLL_S)


class DirectZenoh(Zenoh):
    """The same, called by the thread that reads the link: sooner there, and dearer where there are many."""

    indirect = False


class LoopZenoh(Zenoh):
    """The same into a callback of an event loop, as a program of one's own would have it: bytes, one by one."""

    def receive(self, take: Take, board: Board) -> None:
        import zenoh

        async def listen() -> None:
            loop = asyncio.get_running_loop()

            def hear(sample: Any) -> None:
                loop.call_soon_threadsafe(take, sample.payload.to_bytes()[0])

            session.declare_subscriber("t", zenoh.handlers.Callback(hear, indirect=self.indirect))
            while not board.done:  # noqa: ASYNC110  # it is another process that ends it
                await asyncio.sleep(POLL_S)

        with self._open(listen=False) as session:
            asyncio.run(listen())


class ZeroMq:
    """pyzmq, PUB and SUB over ipc, in blocking style."""

    def __init__(self, folder: Path, _size: int) -> None:
        self._address = f"ipc://{folder / 'q.sock'}"

    @asynccontextmanager
    async def sender(self) -> AsyncIterator[Callable[[bytes], object]]:
        import zmq

        with zmq.Context() as context, context.socket(zmq.PUB) as publisher:
            publisher.bind(self._address)
            yield publisher.send
            publisher.linger = 0

    def receive(self, take: Take, board: Board) -> None:
        import zmq

        with zmq.Context() as context, context.socket(zmq.SUB) as subscriber:
            subscriber.connect(self._address)
            subscriber.subscribe(b"")
            subscriber.rcvtimeo = round(POLL_S * 1000)
            while not board.done:
                try:
                    take(subscriber.recv()[0])
                except zmq.Again:
                    continue


class Ezmsg:
    """ezmsg, whose graph server runs in the sender's process, on a port of its own."""

    def __init__(self, folder: Path, _size: int) -> None:
        self._file = folder / "port"

    @asynccontextmanager
    async def sender(self) -> AsyncIterator[Callable[[bytes], object]]:
        import ezmsg.core as ez

        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            address = probe.getsockname()
        async with ez.GraphContext(address, auto_start=True) as context:
            publisher = await context.publisher("T")
            put(self._file, str(address[1]))
            yield publisher.broadcast

    def receive(self, take: Take, board: Board) -> None:
        import ezmsg.core as ez

        async def hear() -> None:
            await asyncio.to_thread(wait_for, self._file)
            async with ez.GraphContext(("127.0.0.1", int(self._file.read_text()))) as context:
                subscriber = await context.subscriber("T")
                while True:
                    async with subscriber.recv_zero_copy() as message:
                        take(message[0])

        asyncio.run(until_done(hear(), board))


class UnixSocket:
    """asyncio's streams over a unix socket, each message behind its length."""

    def __init__(self, folder: Path, _size: int) -> None:
        self._path = str(folder / "u.sock")

    @asynccontextmanager
    async def sender(self) -> AsyncIterator[Callable[[bytes], object]]:
        writers: list[asyncio.StreamWriter] = []

        def connected(_reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            writers.append(writer)

        server = await asyncio.start_unix_server(connected, self._path)

        async def publish(message: bytes) -> None:
            for writer in writers:
                writer.write(struct.pack("<I", len(message)))
                writer.write(message)
                await writer.drain()

        yield publish
        for writer in writers:
            writer.transport.abort()
        server.close()

    def receive(self, take: Take, board: Board) -> None:
        async def hear() -> None:
            await asyncio.to_thread(wait_for, Path(self._path))
            reader, _ = await asyncio.open_unix_connection(self._path, limit=1 << 24)
            while True:
                (size,) = struct.unpack("<I", await reader.readexactly(4))
                take((await reader.readexactly(size))[0])

        asyncio.run(until_done(hear(), board))


class Memory:
    """The floor: copied into shared memory, a byte through a pipe, copied out; no queue that could overflow."""

    def __init__(self, folder: Path, size: int) -> None:
        self._pipe, self._name, self._size = folder / "bell", folder / "name", size
        self._slots = WINDOWS[size] * 2

    @asynccontextmanager
    async def sender(self) -> AsyncIterator[Callable[[bytes], object]]:
        memory = SharedMemory(create=True, size=self._size * self._slots)
        os.mkfifo(self._pipe)
        bell = os.open(self._pipe, os.O_RDWR)
        put(self._name, memory.name)
        size, slots, at = self._size, self._slots, 0
        room = memory.buf

        def publish(message: bytes) -> None:
            nonlocal at
            start = at % slots * size
            room[start : start + size] = message
            at += 1
            os.write(bell, b"!")

        yield publish
        room.release()
        memory.close()
        with suppress(FileNotFoundError):  # the receiver's Python may have thought it its own, and removed it
            memory.unlink()
        os.close(bell)

    def receive(self, take: Take, board: Board) -> None:
        wait_for(self._name)
        memory = SharedMemory(name=self._name.read_text())
        bell = os.open(self._pipe, os.O_RDONLY)
        size, slots, at = self._size, self._slots, 0
        room = memory.buf
        while not board.done and os.read(bell, 1):
            start = at % slots * size
            take(bytes(room[start : start + size])[0])
            at += 1


LINKS: dict[str, Any] = {
    "Zenoh": Zenoh,
    "Zenoh, direct": DirectZenoh,
    "Zenoh, asyncio": LoopZenoh,
    "pyzmq": ZeroMq,
    "ezmsg": Ezmsg,
    "asyncio unix socket": UnixSocket,
    "shared memory": Memory,
}


def put(file: Path, text: str) -> None:
    """Write a file that is there whole or not at all."""
    part = file.with_suffix(".part")
    part.write_text(text)
    part.rename(file)


def wait_for(file: Path) -> None:
    """Wait until it is there."""
    while not file.exists():
        time.sleep(0.02)


async def until_done(hearing: Any, board: Board) -> None:
    """Hear until the sender has ended."""
    task = asyncio.ensure_future(hearing)
    while not board.done and not task.done():  # noqa: ASYNC110  # it is another process that ends it
        await asyncio.sleep(POLL_S)
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


if __name__ == "__main__":
    place = Path(sys.argv[2])
    noted = Board(place / "board")
    LINKS[sys.argv[1]](place, int(sys.argv[3])).receive(noted.taker(), noted)
    os._exit(0)
