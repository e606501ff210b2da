"""Line: one socket between this process and another one of the run."""

from __future__ import annotations

import asyncio
import os
import socket
from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from busflow.errors import MalformedMessage
from busflow.text import printable
from busflow.wire.line import packets
from busflow.wire.line.arena import Arena, ForeignArena, Piece, Stored
from busflow.wire.line.intake import Arrived, Intake
from busflow.wire.line.packets import HEAD_BYTES, MOST_BYTES, PAYLOAD_AT, Kind, Reason, Wanted
from busflow.wire.line.route import Route
from busflow.wire.line.stream import PacketStream

if TYPE_CHECKING:
    from busflow.log import Logger

_FILE = bytes((Kind.FILE,))


class Owner(Protocol):
    """The owner of a line: all lines of the process."""

    def on_route(self, route: Route, /) -> None:
        """Note that the other end receives a topic."""
        ...

    def on_route_end(self, route: Route, may_read: bool, /) -> None:  # called by position
        """Note that it does so no more, and whether it may still read messages in shared memory."""
        ...

    def on_end(self, line: Line, is_faulty: bool, /) -> None:  # called by position
        """Note that the line has ended, and whether that is for what came on it."""
        ...


class Line:
    """A socket whose packets arrive whole and in order, with the routes and intakes that it carries."""

    def __init__(self, opened: socket.socket, own: str, session: str, owner: Owner, log: Logger) -> None:
        """Introduce this process at an open socket, of packets or of a stream.

        Args:
            opened: the connected socket, which does not block.
            own: the id of this process's session.
            session: the id of the session at the other end; empty if it has to introduce itself first.
            owner: told what happens.
            log: told why a line breaks.
        """
        self.session: str = session
        self.is_open: bool = True
        self._socket, self._owner, self._log = opened, owner, log
        self._inode = os.fstat(opened.fileno()).st_ino
        self._loop = asyncio.get_running_loop()
        self.call_soon: Callable[[Callable[[], None]], object] = self._loop.call_soon
        self._stream = PacketStream(opened, self._await_room) if opened.type == socket.SOCK_STREAM else None
        self._receive: Callable[[int], bytes] = (self._stream or opened).recv
        self.transmit: Callable[[bytes], object] = (self._stream or opened).send
        """Hands a packet to the kernel; raises BlockingIOError if that has no room."""
        self.is_known: bool = False
        """Whether the other end has introduced itself."""
        self._is_reading = False
        self._fault: Exception | None = None
        """Why the line is going to end."""
        self._routes: dict[int, Route] = {}
        self._intakes: dict[int, Intake] = {}
        self.filled: list[Intake] = []
        """The intakes that have messages to hand over."""
        self._by_head: dict[bytes, Intake] = {}
        """The same by the beginning of a packet with one message."""
        self._next = 0
        self._waiting = deque[tuple[bytes, int]]()
        """Packets about routes that wait for room in the socket, with the descriptors that belong to them, or -1."""
        self._blocked: dict[Route, None] = {}
        """Routes that wait for room in the socket, in their order."""
        self._shown: Arena | None = None
        """This process's arena, of which the other end has the descriptor."""
        self._arena: ForeignArena | None = None
        self._announced = 0
        """Size of the other end's memory, whose descriptor comes next."""
        self._loop.add_reader(opened, self.read)
        self.tell(packets.hello(own))

    @property
    def routes(self) -> Iterable[Route]:
        """The topics that the other end receives."""
        return self._routes.values()

    @property
    def waits(self) -> bool:
        """Whether anything waits for the other end."""
        return bool(self._waiting) or any(route.waiting for route in self._routes.values())

    @property
    def is_blocked(self) -> bool:
        """Whether anything waits for room in the socket."""
        return bool(self._waiting or self._blocked)

    def fileno(self) -> int:
        """Return the socket's descriptor."""
        return self._socket.fileno()

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
        self._by_head[packets.head(Kind.MESSAGE, self._next)] = intake
        self.tell(packets.opened(self._next, key, wanted))
        return intake

    def check(self) -> None:
        """End the line if a plugin has closed its descriptor."""
        if self.is_open and not self._is_own():
            self._end(OSError("its descriptor was closed in this process"))

    def close(self) -> None:
        """Close the socket; the other end sees that when it has read what is there."""
        self._end(None)

    def abandon(self) -> None:
        """Close this copy of the socket in a process that was forked; the loop's descriptors are the parent's."""
        self.is_open = False
        self._socket.close()

    # What routes and intakes call.

    def transmit_piece(self, packet: bytes, stored: Stored) -> None:
        """Do as `transmit` does with the place of a message, whose memory the other end gets before."""
        if self._shown is not stored.arena:
            self.transmit(packets.packed(Kind.ARENA, stored.arena.capacity))
            self._shown = stored.arena
            self._waiting.append((_FILE, stored.arena.fd))
        self._send_waiting()
        if self._waiting:
            raise BlockingIOError
        self.transmit(packet)

    def wait_for_room(self, route: Route) -> None:
        """Call the route's `flush` as soon as the kernel has room."""
        self._blocked[route] = None
        self._await_room()

    def fail(self, error: OSError) -> None:
        """Read what is left, and end the line, in the loop's next turn: a packet could not be sent."""
        if self._fault is None:
            self._fault = error
            self.call_soon(self.read)

    def tell(self, packet: bytes) -> None:
        """Send a packet about a route in its order, as soon as the kernel has room."""
        if self.is_open:
            self._waiting.append((packet, -1))
            self._send_waiting()

    def forget(self, number: int) -> None:
        """Forget an intake, which is closed."""
        self._intakes.pop(number, None)
        self._by_head.pop(packets.head(Kind.MESSAGE, number), None)

    def _send_waiting(self) -> None:
        try:
            while self._waiting:
                packet, fd = self._waiting[0]
                if fd < 0:
                    self.transmit(packet)
                else:
                    socket.send_fds(self._socket, [packet], [fd])
                self._waiting.popleft()
        except BlockingIOError:
            self._await_room()
        except OSError as error:
            self.fail(error)

    def _await_room(self) -> None:
        if self.is_open:
            self._loop.add_writer(self._socket, self.go_on)

    def go_on(self) -> None:
        """Send what waits, since the kernel has room again: first what this process says, then each route in turn."""
        if not self.is_open:
            return
        self._loop.remove_writer(self._socket)
        if self._stream is not None:
            self._stream.flush()
        self._send_waiting()
        blocked, self._blocked = self._blocked, {}
        for route in blocked:
            route.flush()

    # What arrives.

    def read(self) -> None:
        """Read what is there, until the socket is empty, and then hand it over."""
        if self._is_reading or not self.is_open:
            return
        self._is_reading = True
        try:
            if self._read_all() and self._fault is None:
                self._fault = ConnectionError("the other end has closed it")
            while self.filled:
                self.filled.pop(0).hand_over()
        finally:
            self._is_reading = False
        if self._fault is not None:
            self._end(self._fault)

    def _read_all(self) -> bool:
        """Read what is there; return whether the other end has closed the line."""
        by_head = self._by_head
        while True:
            try:
                while data := self._receive(MOST_BYTES):
                    intake = by_head.get(data[:HEAD_BYTES])
                    if intake is not None and self.is_known and PAYLOAD_AT <= len(data) < MOST_BYTES:
                        intake.add(data[PAYLOAD_AT:], data[HEAD_BYTES:PAYLOAD_AT])
                    else:
                        self._read_other(data)
            except BlockingIOError:
                return False
            except ConnectionResetError:
                continue  # the other end has gone without reading all; what it has sent is still there
            except OSError as error:
                self._fault = error
            except packets.NO_PACKET as error:
                self._fault = MalformedMessage(f"what came is no packet: {error}")
            return True

    def _read_other(self, data: bytes) -> None:
        """Read a packet that is not a message for an open intake; it may be none, or come at a wrong time."""
        if self.is_known and (reader := self._READERS.get(data[0])) is not None:
            reader(self, data)
        elif self.is_known and data[0] == Kind.MESSAGE and PAYLOAD_AT <= len(data) < MOST_BYTES:
            packets.number_of(data)  # its intake is closed already
        else:
            self._introduce(data)

    def _introduce(self, data: bytes) -> None:
        """Note the session at the other end, which its first packet states; no other packet comes here."""
        session = packets.read_hello(data)
        if self.is_known or self.session not in ("", session):
            raise MalformedMessage(f"another session introduces itself: {printable(session, limit=60)}")
        self.session, self.is_known = session, True

    def _intake(self, data: bytes) -> Intake | None:
        """Return the intake that a packet is for; None if it is closed already."""
        return self._intakes.get(packets.number_of(data))

    def _read_open(self, data: bytes) -> None:
        number, key, wanted = packets.read_opened(data)
        if not key:
            self._route(number).change(wanted)
            return
        if number in self._routes:
            raise MalformedMessage(f"route {number} is opened twice")
        self._routes[number] = route = Route(number, key, self.session, wanted, self)
        self._owner.on_route(route)

    def _read_close(self, data: bytes) -> None:
        number = packets.number_of(data)
        route = self._route(number)
        del self._routes[number]
        self._blocked.pop(route, None)
        route.end()
        self._owner.on_route_end(route, False)  # by position

    def _read_credit(self, data: bytes) -> None:
        number, count = packets.values_of(data)
        self._route(number).acknowledge(count)

    def _route(self, number: int) -> Route:
        if number not in self._routes:
            raise MalformedMessage(f"there is no route {number}")
        return self._routes[number]

    def _read_burst(self, data: bytes) -> None:
        if (intake := self._intake(data)) is not None:
            intake.add_all(packets.read_burst(data))

    def _read_piece(self, data: bytes) -> None:
        number, attachment, offset, size = packets.values_of(data)
        if self._arena is None or offset + size > self._arena.size:
            raise MalformedMessage(f"{size:,} bytes at {offset:,} do not lie in the sender's memory")
        if (intake := self._intakes.get(number)) is not None:
            intake.add_all([(Piece(self._arena, offset, size), attachment)], is_urgent=True)

    def _read_part(self, data: bytes) -> None:
        if (intake := self._intake(data)) is not None:
            intake.add_part(data[HEAD_BYTES:])

    def _read_mark(self, data: bytes) -> None:
        number, attachment, reason = packets.values_of(data)
        if (intake := self._intakes.get(number)) is not None:
            intake.add_all([(Reason(reason), attachment)])

    def _read_arena(self, data: bytes) -> None:
        """Expect a descriptor: only a call that asks for descriptors gets it, and such a call takes longer."""
        (self._announced,) = packets.values_of(data)
        self._receive = self._receive_file

    def _receive_file(self, most: int) -> bytes:
        """Return the next packet, unless it has the descriptor of the other end's memory: map that, and go on."""
        data, fds, _, _ = socket.recv_fds(self._socket, most, 1, socket.MSG_CMSG_CLOEXEC)
        if data != _FILE:
            return data
        try:
            if len(fds) != 1:
                raise OSError("the descriptor of the other process's memory did not come; see ulimit -n")
            self._arena = ForeignArena(fds[0], self._announced)
        finally:
            for fd in fds:
                os.close(fd)
        self._receive = self._socket.recv
        return self._receive(most)

    _READERS: ClassVar[Mapping[int, Callable[[Any, bytes], None]]] = {
        Kind.OPEN: _read_open,
        Kind.CLOSE: _read_close,
        Kind.CREDIT: _read_credit,
        Kind.BURST: _read_burst,
        Kind.PIECE: _read_piece,
        Kind.ARENA: _read_arena,
        Kind.PART: _read_part,
        Kind.MARK: _read_mark,
    }
    """By kind, what reads a packet."""

    # The end.

    def _is_own(self) -> bool:
        """Return whether the descriptor is still this socket, which a plugin may have closed."""
        return is_own(self._socket, self._inode)

    def _end(self, why: Exception | None) -> None:
        """End the line; every intake learns it behind the messages that have arrived."""
        if not self.is_open:
            return
        self.is_open = False
        is_faulty = why is not None and not isinstance(why, ConnectionError)
        if is_faulty:
            self._log.warning(f"the line to another process of the run is closed: {printable(str(why))}")
        self._loop.remove_reader(self._socket)
        self._loop.remove_writer(self._socket)
        if self._is_own():
            self._socket.close()
        else:
            self._socket.detach()  # its number may be another file's by now
        for route in self._routes.values():
            self._owner.on_route_end(route, route.end())
        self._routes.clear()
        self._blocked.clear()
        self._owner.on_end(self, is_faulty)
        intakes, self._intakes = self._intakes, {}
        self._by_head.clear()
        for intake in intakes.values():
            intake.end()


def is_own(opened: socket.socket, inode: int) -> bool:
    """Return whether the descriptor still belongs to this file; a plugin may have closed it."""
    try:
        return os.fstat(opened.fileno()).st_ino == inode
    except OSError:
        return False
