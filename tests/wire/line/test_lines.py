"""Lines: two of them in one process, on one event loop, over a folder, with real sockets and memory."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import wraps
from pathlib import Path
from typing import Any

import pytest

from busflow.bus.qos import Overflow
from busflow.log import Logger
from busflow.wire.line.arena import Piece, Pieces
from busflow.wire.line.lines import Lines
from busflow.wire.line.packets import LARGE, Reason, Wanted
from busflow.wire.zenoh.keys import Attachment, attachment_bytes

KEY = "0/chatter/std_msgs::msg::dds_::String_/RIHS01_00"
GID = bytes(range(16))
SLOW_NS = 1_000_000_000
"""A time between two messages after which the second leaves at once."""


def on_a_loop(test: Callable[..., Coroutine[Any, Any, None]]) -> Callable[..., None]:
    """Run a test on a loop of its own."""

    async def whole(ends: Ends) -> None:
        try:
            await asyncio.wait_for(test(ends), 60)
        finally:
            ends.close()

    @wraps(test)
    def run(ends: Ends) -> None:
        asyncio.run(whole(ends))

    return run


class Process:
    """One end: its lines, and what happens to them."""

    def __init__(self, folder: Path, session: str) -> None:
        self.session, self.log = session, []
        self.changes: list[str] = []
        self.arrived: list[tuple[Any, int]] = []
        self.ends: list[str] = []
        self.lines = Lines(folder, session, self.changes.append, Logger(lambda *line: self.log.append(line[:2])))
        self.lines.begin()
        self.number = 0
        self.now_ns = SLOW_NS

    def receive(self, other: Process, depth: int = 10, overflow: Overflow = Overflow.DROP_OLDEST, *, key: str = KEY):
        """Receive a topic of another process, and acknowledge nothing."""

        def take(messages: Any) -> None:
            for payload, attachment in messages:
                number = Attachment.decode(attachment).sequence
                self.arrived.append((payload.read() if isinstance(payload, Piece) else payload, number))

        return self.lines.receive(
            other.session, key, Wanted(depth, overflow), take, lambda: self.ends.append(other.session)
        )

    def send(self, payload: bytes | Pieces, *, after_ns: int = SLOW_NS, key: str = KEY) -> None:
        self.number += 1
        self.now_ns += after_ns
        self.lines.send(key, payload, attachment_bytes(self.number, self.now_ns, GID), self.now_ns)

    @property
    def numbers(self) -> list[int]:
        return [number for _, number in self.arrived]


class Ends:
    """Processes that can reach each other."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._made = folder, list[Process]()

    def __call__(self, session: str) -> Process:
        self._made.append(Process(self._folder, session))
        return self._made[-1]

    def close(self) -> None:
        for each in self._made:
            each.lines.close()


@pytest.fixture
def ends(tmp_path: Path) -> Ends:
    return Ends(tmp_path)


async def turn(until: Callable[[], object]) -> None:
    """Let the loop turn until this is so."""
    while not until():  # noqa: ASYNC110  # nothing says when a socket has been read
        await asyncio.sleep(0)


@on_a_loop
async def test_a_message_arrives_as_it_was_sent(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer)
    writer.lines.read()
    writer.send(b"hello")
    await turn(lambda: reader.arrived)
    assert reader.arrived == [(b"hello", 1)]
    assert writer.changes == [KEY]
    writer.lines.close()
    await turn(lambda: reader.ends)
    assert reader.ends == [writer.session]


@on_a_loop
async def test_a_session_without_a_socket_has_no_line(ends):
    reader = ends("bbbbbbbb02")
    assert reader.lines.receive("cccccccc", KEY, Wanted(1), print, print) is None


@on_a_loop
async def test_large_messages_arrive_whole(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer)
    writer.lines.read()
    large = bytes(range(256)) * 8192
    writer.send(large)
    writer.send(Pieces([b"head", large], len(large) + 4))
    await turn(lambda: len(reader.arrived) == 2)
    assert reader.arrived == [(large, 1), (b"head" + large, 2)]
    intake.acknowledge(2)
    await turn(lambda: not writer.lines.capacity)


@on_a_loop
async def test_a_reader_that_is_behind_gets_the_newest_messages(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer, depth=2)
    writer.lines.read()
    for _ in range(100):
        writer.send(b"x")
    await turn(lambda: len(reader.arrived) == 32)
    intake.acknowledge(32)
    await turn(lambda: len(reader.arrived) == 34)
    assert reader.numbers == [*range(1, 33), 99, 100]
    assert [(route.sent, route.dropped) for route in writer.lines.routes(KEY)] == [(34, 66)]


@on_a_loop
async def test_a_mark_tells_of_the_newest_messages_that_were_dropped(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer, depth=2, overflow=Overflow.DROP_NEWEST)
    writer.lines.read()
    for _ in range(100):
        writer.send(b"x")
    await turn(lambda: len(reader.arrived) == 32)
    intake.acknowledge(32)
    await turn(lambda: len(reader.arrived) == 35)
    assert reader.numbers == [*range(1, 35), 100]
    assert reader.arrived[-1] == (Reason.OVERFLOW, 100)


@on_a_loop
async def test_messages_that_follow_closely_leave_together(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    reader.receive(writer, depth=100)
    writer.lines.read()
    for _ in range(40):
        writer.send(b"x", after_ns=1)
    await turn(lambda: len(reader.arrived) == 40)
    assert reader.numbers == [*range(1, 41)]
    (route,) = writer.lines.routes(KEY)
    assert route.unacknowledged == 3  # the first, thirty-two, and the rest


@on_a_loop
async def test_a_message_travels_in_parts_where_memory_is_full(ends):
    writer, reader = ends("aaaaaaaa01"), ends("bbbbbbbb02")
    intake = reader.receive(writer)
    writer.lines.read()
    writer.send(bytes(240 << 20))
    large = bytes(range(256)) * 80_000  # more than there is room for
    writer.send(large)
    await turn(lambda: reader.arrived)
    intake.acknowledge(1)
    await turn(lambda: len(reader.arrived) == 2)
    assert reader.arrived[1] == (large, 2)
    assert len(large) > 32 * LARGE
