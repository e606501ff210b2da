"""Line: one end of a socket, whose other end the test holds and says anything at."""

from __future__ import annotations

import asyncio
import os
import socket
from collections.abc import Callable, Iterator
from typing import Any

import pytest

from busflow.bus.qos import Overflow
from busflow.log import Logger
from busflow.wire.line import packets
from busflow.wire.line.arena import Arena
from busflow.wire.line.line import Line
from busflow.wire.line.packets import Kind, Reason, Wanted
from busflow.wire.line.route import Route

WANTED = Wanted(2, Overflow.DROP_OLDEST)
ATTACHMENT = bytes(33)
ROUTE = 1
"""The number of the first route that a line opens."""


class End:
    """The end under test, and the other one."""

    runner: asyncio.Runner

    def __init__(self) -> None:
        own, self.other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        own.setblocking(False)
        self.log: list[tuple[str, str]] = []
        self.happened: list[str] = []
        self.routes: list[Route] = []
        self.line = Line(own, "aa", "bb", self, Logger(lambda *line: self.log.append(line[:2])))
        self.arrived: list[tuple[Any, bytes]] = []
        assert self.other.recv(100) == packets.hello("aa")

    def say(self, *data: bytes) -> None:
        """Send packets to the end under test, which reads them."""
        for each in data:
            self.other.send(each)
        self.line.read()

    def turn_until(self, is_so: Callable[[], bool]) -> None:
        """Let the loop turn until this is so."""

        async def turn() -> None:
            while not is_so():  # noqa: ASYNC110  # nothing says when a socket has room
                await asyncio.sleep(0)

        self.runner.run(asyncio.wait_for(turn(), 60))

    def receive(self):
        intake = self.line.receive("key", WANTED, self.arrived.extend, lambda: self.happened.append("intake ended"))
        assert self.other.recv(100) == packets.opened(ROUTE, "key", WANTED)
        return intake

    def on_route(self, route: Route) -> None:
        self.routes.append(route)

    def on_route_end(self, route: Route, may_read: bool) -> None:
        self.happened.append(f"route {route.key} ended{', which may be read' * may_read}")

    def on_end(self, _line: Line, is_faulty: bool) -> None:
        self.happened.append("ended" + ", faulty" * is_faulty)


@pytest.fixture
def end() -> Iterator[End]:
    with asyncio.Runner() as runner:

        async def made() -> End:
            return End()

        made_end = runner.run(made())
        made_end.runner = runner
        yield made_end

        async def closed() -> None:
            made_end.line.close()

        runner.run(closed())
        made_end.other.close()


HELLO = packets.hello("bb")


def test_the_other_end_introduces_itself(end: End):
    end.say(HELLO)
    assert end.line.is_known


@pytest.mark.parametrize(
    "said",
    [
        [packets.head(Kind.MESSAGE, ROUTE) + ATTACHMENT + b"x"],  # before it has introduced itself
        [packets.hello("cc")],
        [bytes((Kind.HELLO, 99)) + b"bb"],
        [HELLO, HELLO],
        [HELLO, b"\xff"],
        [HELLO, b"\x00" * 100],
        [HELLO, bytes((Kind.MESSAGE,))],
        [HELLO, packets.head(Kind.MESSAGE, ROUTE) + b"too short"],
        [HELLO, packets.packed(Kind.CREDIT, 5, 1)],
        [HELLO, packets.opened(5, "key", WANTED), packets.opened(5, "key", WANTED)],
        [HELLO, packets.opened(5, "key", WANTED), packets.packed(Kind.CREDIT, 5, 1)],
        [HELLO, packets.packed(Kind.PIECE, ROUTE, ATTACHMENT, 0, 1)],
        [HELLO, packets.opened(5, "", WANTED)],
        [HELLO, packets.packed(Kind.MARK, ROUTE, ATTACHMENT, 9)],
        [HELLO, packets.packed(Kind.MARK, ROUTE, ATTACHMENT, Reason.END) + b"x"],
        [HELLO, packets.head(Kind.PART, ROUTE) + b"x", packets.packed(Kind.MARK, ROUTE, ATTACHMENT, Reason.END)],
        [HELLO, packets.head(Kind.MESSAGE, ROUTE) + bytes(packets.MOST_BYTES)],
    ],
)
def test_what_is_no_packet_ends_the_line_with_one_line_of_log(end: End, said: list[bytes]):
    end.receive()
    end.say(*said)
    assert not end.line.is_open
    assert [level for level, _ in end.log] == ["warning"]
    assert end.happened[-2:] == ["ended, faulty", "intake ended"]


def test_messages_before_a_fault_are_handed_over(end: End):
    end.receive()
    end.say(HELLO, packets.head(Kind.MESSAGE, ROUTE) + ATTACHMENT + b"x", b"\xff")
    assert end.arrived == [(b"x", ATTACHMENT)]


def test_the_end_of_the_other_side_comes_behind_its_messages(end: End):
    end.receive().change(Wanted(9))  # which the other side never reads: its end is then an error first
    end.other.send(HELLO)
    end.other.send(packets.head(Kind.MESSAGE, ROUTE) + ATTACHMENT + b"x")
    end.other.close()
    end.line.read()
    assert end.arrived == [(b"x", ATTACHMENT)]
    assert end.happened == ["ended", "intake ended"]
    assert end.log == []


def test_half_a_message_is_dropped_with_its_sender(end: End):
    end.receive()
    end.other.send(HELLO)
    end.other.send(packets.head(Kind.PART, ROUTE) + b"x")
    end.other.close()
    end.line.read()
    assert end.arrived == []
    assert end.happened[-1] == "intake ended"


def test_messages_for_a_closed_intake_are_ignored(end: End):
    end.receive().close()
    assert end.other.recv(100) == packets.head(Kind.CLOSE, ROUTE)
    end.say(HELLO, packets.head(Kind.MESSAGE, ROUTE) + ATTACHMENT + b"x", packets.burst(ROUTE, [(b"x", ATTACHMENT)]))
    assert end.line.is_open
    assert end.arrived == []


def test_a_route_ends_when_its_reader_says_so(end: End):
    end.say(HELLO, packets.opened(5, "key", WANTED))
    end.say(packets.opened(5, "", Wanted(9)), packets.head(Kind.CLOSE, 5))
    assert [route.has_ended for route in end.routes] == [True]
    assert end.happened == ["route key ended"]


def sent_until_full(end: End) -> int:
    """Fill the socket with what the end says of itself; return how many packets it holds."""
    count = 0
    while True:
        try:
            end.line.transmit(bytes(100))
        except BlockingIOError:
            return count
        count += 1


def test_what_waits_for_room_leaves_in_order_once_there_is_some(end: End):
    end.say(HELLO, packets.opened(5, "key", Wanted(1000)))
    (route,) = end.routes
    count = sent_until_full(end)
    route.send(b"first", ATTACHMENT, 10**9)
    route.send(b"second", ATTACHMENT, 2 * 10**9)
    intake = end.line.receive("other", WANTED, print, print)
    for _ in range(count):
        assert end.other.recv(200) == bytes(100)
    end.turn_until(lambda: not route.waiting)
    assert end.other.recv(200) == packets.opened(ROUTE, "other", WANTED)
    assert packets.read_burst(end.other.recv(200)) == [(b"first", ATTACHMENT), (b"second", ATTACHMENT)]
    intake.close()


def test_a_descriptor_that_does_not_come_ends_the_line(end: End):
    end.receive()
    end.say(HELLO, packets.packed(Kind.ARENA, 1 << 20), bytes((Kind.FILE,)))
    assert not end.line.is_open
    assert len(end.log) == 1


def test_a_piece_beyond_the_memory_ends_the_line(end: End):
    end.receive()
    arena = Arena(1 << 20)
    end.say(HELLO, packets.packed(Kind.ARENA, arena.capacity))
    socket.send_fds(end.other, [bytes((Kind.FILE,))], [arena.fd])
    end.say(packets.packed(Kind.PIECE, ROUTE, ATTACHMENT, 1 << 20, 1))
    assert not end.line.is_open


def test_a_descriptor_of_anything_else_is_closed(end: End):
    end.say(HELLO, packets.packed(Kind.ARENA, 1 << 20))
    with open("/dev/null", "rb") as other:  # noqa: PTH123  # a descriptor
        before = set(os.listdir("/dev/fd"))  # noqa: PTH208  # names
        socket.send_fds(end.other, [bytes((Kind.FILE,))], [other.fileno()])
        end.line.read()
    assert not end.line.is_open
    assert len(set(os.listdir("/dev/fd")) - before) == 0  # noqa: PTH208  # names
