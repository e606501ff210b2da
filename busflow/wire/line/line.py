"""Line: one socket between this process and another one of the run."""

from __future__ import annotations

import array
import asyncio
import os
import socket
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

from busflow.errors import MalformedMessage
from busflow.text import printable
from busflow.wire.line import packets
from busflow.wire.line.arena import Arena, ForeignArena, Piece, Stored
from busflow.wire.line.intake import Arrived, Intake
from busflow.wire.line.packets import HEAD_BYTES, MOST_BYTES, PAYLOAD_AT, Kind, Wanted
from busflow.wire.line.route import Route

if TYPE_CHECKING:
    from busflow.log import Logger

_FD = array.array("i")
_FD_ROOM = socket.CMSG_SPACE(_FD.itemsize)


class Owner(Protocol):
    """The owner of a line: all lines of the process."""

    def on_hello(self, line: Line, /) -> None:
        """Note that the session at the other end is known."""
        ...

    def on_route(self, route: Route, /) -> None:
        """Note that the other end receives a topic."""
        ...

    def on_route_end(self, route: Route, may_read: bool, /) -> None:  # called by position
        """Note that it does so no more, and whether it may still read messages in shared memory."""
        ...

    def on_end(self, line: Line, /) -> None:
        """Note that the line has ended."""
        ...


class Line:
    """A socket whose packets arrive whole and in order, with the routes and intakes that it carries."""

    def __init__(self, opened: socket.socket, own: str, session: str, owner: Owner, log: Logger) -> None:
        """Introduce this process at an open socket.

        Args:
            opened: the connected socket.
            own: the id of this process's session.
            session: the id of the session at the other end; empty if it has to introduce itself first.
            owner: told what happens.
            log: told why a line breaks.
        """
        self.session = session
        self.is_open = True
        self._socket, self._owner, self._log = opened, owner, log
        self._loop = asyncio.get_running_loop()
        self.call_soon: Callable[[Callable[[], None]], object] = self._loop.call_soon
        self._is_known = False
        """Whether the other end has introduced itself."""
        self._routes: dict[int, Route] = {}
        self._intakes: dict[int, Intake] = {}
        self._next = 0
        self._waiting = deque[tuple[bytes, int]]()
        """Packets about routes that wait for room in the socket, with the descriptors that belong to them, or -1."""
        self._blocked: dict[Route, None] = {}
        """Routes that wait for room in the socket, in their order."""
        self._shown: Arena | None = None
        """This process's arena, of which the other end has the descriptor."""
        self._arena: ForeignArena | None = None
        self._announced = 0
        """Size of the other end's memory, whose descriptor comes next; 0 if none does."""
        self._readers: Mapping[int, Callable[[bytes], None]] = {
            Kind.OPEN: self._read_open,
            Kind.CHANGE: self._read_change,
            Kind.CLOSE: self._read_close,
            Kind.CREDIT: self._read_credit,
            Kind.BURST: self._read_burst,
            Kind.PIECE: self._read_piece,
            Kind.ARENA: self._read_arena,
            Kind.PART: self._read_part,
            Kind.MARK: self._read_mark,
        }
        opened.setblocking(False)  # the socket module's signature
        self._loop.add_reader(opened, self.read)
        self.tell(packets.hello(own))

    def receive(
        self,
        key: str,
        wanted: Wanted,
        take: Callable[[Sequence[Arrived]], None],
        on_end: Callable[[], None],
    ) -> Intake:
        """Receive a topic from the other end."""
        self._next += 1
        intake = self._intakes[self._next] = Intake(self._next, wanted, take, on_end, self)
        self.tell(packets.opened(self._next, key, wanted))
        return intake

    def close(self) -> None:
        """Close the socket; the other end sees that when it has read what is there."""
        self._end(None)

    def abandon(self) -> None:
        """Close this copy of the socket in a process that was forked; the loop's descriptors are the parent's."""
        self.is_open = False
        self._socket.close()

    # What routes and intakes call.

    def transmit(self, packet: bytes) -> None:
        """Hand a packet to the kernel, or raise BlockingIOError if it has no room; a broken line ends."""
        try:
            self._socket.send(packet)
        except BlockingIOError:
            raise
        except OSError as error:
            self._end(error)

    def transmit_piece(self, packet: bytes, stored: Stored) -> None:
        """Do the same with the place of a message, whose memory the other end gets before."""
        if self._shown is not stored.arena:
            self.transmit(packets.arena(stored.arena.capacity))
            self._waiting.append((bytes((Kind.FILE,)), stored.arena.fd))
            self._shown = stored.arena
            self._send_waiting()
        if self._waiting:
            raise BlockingIOError
        self.transmit(packet)

    def wait_for_room(self, route: Route) -> None:
        """Call the route's `flush` as soon as the kernel has room."""
        self._blocked[route] = None
        if self.is_open:
            self._loop.add_writer(self._socket, self._go_on)

    def tell(self, packet: bytes) -> None:
        """Send a packet about a route in its order, as soon as the kernel has room."""
        if self.is_open:
            self._waiting.append((packet, -1))
            self._send_waiting()

    def forget(self, number: int) -> None:
        """Forget an intake, which is closed."""
        self._intakes.pop(number, None)

    def _send_waiting(self) -> None:
        try:
            while self._waiting:
                packet, fd = self._waiting[0]
                if fd < 0:
                    self._socket.send(packet)
                else:
                    rights = (socket.SOL_SOCKET, socket.SCM_RIGHTS, array.array("i", [fd]))
                    self._socket.sendmsg([packet], [rights])
                self._waiting.popleft()
        except BlockingIOError:
            self._loop.add_writer(self._socket, self._go_on)
        except OSError as error:
            self._end(error)

    def _go_on(self) -> None:
        """Send what waits, since the kernel has room again: first what this process says, then each route in turn."""
        self._loop.remove_writer(self._socket)
        self._send_waiting()
        blocked, self._blocked = self._blocked, {}
        for route in blocked:
            route.flush()

    # What arrives.

    def read(self) -> None:
        """Read what is there, until the socket is empty, and then hand it over."""
        error: Exception | None = None
        try:
            while self.is_open and (data := self._receive()):
                if data[0] == Kind.MESSAGE and self._is_known and PAYLOAD_AT <= len(data) < MOST_BYTES:
                    if intake := self._intake(data):
                        intake.add(data[PAYLOAD_AT:], data[HEAD_BYTES:PAYLOAD_AT])
                elif self._is_known and (reader := self._readers.get(data[0])):
                    reader(data)
                else:
                    self._introduce(data)
            ended = True
        except BlockingIOError:
            ended = False
        except (OSError, MalformedMessage) as caught:
            ended, error = True, caught
        for intake in tuple(self._intakes.values()):
            intake.hand_over()
        if ended:
            self._end(error)

    def _receive(self) -> bytes:
        """Return the next packet; none if the other end has closed the line."""
        if not self._announced:
            return self._socket.recv(MOST_BYTES)
        data, rights, _, _ = self._socket.recvmsg(MOST_BYTES, _FD_ROOM)
        if data[:1] == bytes((Kind.FILE,)):
            self._map(rights)
            return self._receive()
        return data

    def _map(self, rights: list[tuple[int, int, bytes]]) -> None:
        """Map the memory whose descriptor has come."""
        fds = array.array("i")
        for _, _, data in rights:
            fds.frombytes(data[: len(data) - len(data) % fds.itemsize])
        try:
            if len(fds) != 1:
                raise OSError("the descriptor of the other process's memory did not come; see ulimit -n")
            self._arena = ForeignArena(fds[0], self._announced)
        finally:
            for fd in fds:
                os.close(fd)
        self._announced = 0

    def _introduce(self, data: bytes) -> None:
        """Note the session at the other end, which its first packet states; no other packet comes here.

        Raises:
            MalformedMessage: It is another packet, or another session.
        """
        session = packets.read_hello(data)
        if self._is_known or self.session not in ("", session):
            raise MalformedMessage(f"another session introduces itself: {printable(session, limit=60)}")
        self.session, self._is_known = session, True
        self._owner.on_hello(self)

    def _intake(self, data: bytes) -> Intake | None:
        """Return the intake that a packet is for; None if it is closed already."""
        return self._intakes.get(packets.number_of(data))

    def _read_open(self, data: bytes) -> None:
        number, wanted, key = packets.read_wanted(data)
        if number in self._routes:
            raise MalformedMessage(f"route {number} is opened twice")
        self._routes[number] = route = Route(number, key, self.session, wanted, self)
        self._owner.on_route(route)

    def _read_change(self, data: bytes) -> None:
        number, wanted, _ = packets.read_wanted(data)
        self._route(number).change(wanted)

    def _read_close(self, data: bytes) -> None:
        number = packets.number_of(data)
        self._end_route(self._route(number))
        del self._routes[number]

    def _read_credit(self, data: bytes) -> None:
        number, count = packets.read_credit(data)
        self._route(number).acknowledge(count)

    def _route(self, number: int) -> Route:
        if number not in self._routes:
            raise MalformedMessage(f"there is no route {number}")
        return self._routes[number]

    def _read_burst(self, data: bytes) -> None:
        if intake := self._intake(data):
            intake.add_all(packets.read_burst(data))

    def _read_piece(self, data: bytes) -> None:
        attachment, offset, size = packets.read_piece(data)
        if self._arena is None or offset + size > self._arena.size:
            raise MalformedMessage(f"{size:,} bytes at {offset:,} do not lie in the sender's memory")
        if intake := self._intake(data):
            intake.add_all([(Piece(self._arena, offset, size), attachment)], is_urgent=True)

    def _read_arena(self, data: bytes) -> None:
        self._announced = packets.read_arena(data)

    def _read_part(self, data: bytes) -> None:
        if intake := self._intake(data):
            intake.add_part(data[HEAD_BYTES:])

    def _read_mark(self, data: bytes) -> None:
        mark = packets.read_mark(data)
        if intake := self._intake(data):
            intake.add_all([mark])

    # The end.

    def _end_route(self, route: Route) -> None:
        self._blocked.pop(route, None)
        self._owner.on_route_end(route, route.end())

    def _end(self, why: Exception | None) -> None:
        """End the line; every intake learns it behind the messages that have arrived."""
        if not self.is_open:
            return
        self.is_open = False
        if why is not None and not isinstance(why, ConnectionError):
            self._log.warning(f"the line to another process of the run is closed: {printable(str(why))}")
        self._loop.remove_reader(self._socket)
        self._loop.remove_writer(self._socket)
        self._socket.close()
        for route in tuple(self._routes.values()):
            self._end_route(route)
        self._routes.clear()
        self._owner.on_end(self)
        intakes, self._intakes = self._intakes, {}
        for intake in intakes.values():
            intake.end()
