"""Lines: those of this process to all others of the run that it can reach."""

from __future__ import annotations

import asyncio
import os
import select
import socket
import struct
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from errno import EMFILE, ENFILE
from pathlib import Path
from typing import TYPE_CHECKING

from busflow import clock
from busflow.runner.own_process import call_in_children
from busflow.wire.line.arena import Arena, Pieces, Stored
from busflow.wire.line.intake import Arrived, Intake
from busflow.wire.line.line import Line, is_own
from busflow.wire.line.packets import Wanted
from busflow.wire.line.route import Route
from busflow.wire.zenoh.sender import LARGE

if TYPE_CHECKING:
    from busflow.log import Logger

_NAME_DIGITS = 8
_BACKLOG = 128
_SEND_BUFFER = 1 << 20
"""Size of a socket's buffer in bytes, of which the system gives a part. Linux gives 208 KiB to who does not ask."""
_CREDENTIALS = struct.Struct("iII")
_IDLE_S = 10.0
"""Time after which memory that no message has needed is given back."""


def socket_name(session: str) -> str:
    """Return the name of a session's socket in the run's directory; it is as short as that of Zenoh's socket."""
    return f"~{session[:_NAME_DIGITS]}"


class Lines:
    """The lines of a process: it connects to whom it wants to receive from, and accepts who wants to receive."""

    def __init__(
        self,
        directory: Path,
        session: str,
        on_route: Callable[[str], None],
        log: Logger,
        *,
        has_packets: bool = sys.platform == "linux",
    ) -> None:
        """Create lines; nobody reaches them before `begin`.

        Args:
            directory: the run's directory, by a path that leads there in this process.
            session: the id of this process's session.
            on_route: called with a topic's key whenever a reader of it has come or gone.
            log: told why a line breaks, or why there is none.
            has_packets: whether the system has Unix sockets of packets, which can pass memory; else streams are used.
        """
        self._directory, self._session, self._on_route, self._log = directory, session, on_route, log
        self._type = socket.SOCK_SEQPACKET if has_packets else socket.SOCK_STREAM
        self._listener: socket.socket | None = None
        self._inode = 0
        self._spare = -1
        """A descriptor that is given up for a moment where no other is left."""
        self._lines: list[Line] = []
        self._routes: dict[str, list[Route]] = {}
        self._broken: set[str] = set()
        """Sessions whose line has broken once."""
        self._faulty: set[str] = set()
        """Sessions that get no line any more: it broke twice, or for what came on it, or there is no descriptor."""
        self.refusals: dict[str, str] = {}
        """By session to which no line could be made, the reason of the last time."""
        self._arena: Arena | None = None
        self._trimming: asyncio.TimerHandle | None = None
        call_in_children(self._abandon)

    @property
    def capacity(self) -> int:
        """Bytes of shared memory that messages of this process take."""
        return 0 if self._arena is None else self._arena.written

    @property
    def sessions(self) -> set[str]:
        """The ids of the sessions that have a line to this process."""
        return {line.session for line in self._lines if line.session}

    def begin(self) -> None:
        """Listen in the run's directory, if the system has Unix sockets."""
        if not hasattr(socket, "AF_UNIX"):
            return
        listener = None
        try:
            listener = self._socket()
            path = self._path(self._session)
            listener.bind(path)
            os.chmod(path, 0o600)  # noqa: PTH101  # the same path goes to the kernel
            listener.listen(_BACKLOG)
            self._spare = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)
        except OSError as error:
            self._log.warning(f"other processes of the run reach this one through Zenoh alone: {error}")
            if listener is not None:
                listener.close()
            return
        self._listener, self._inode = listener, os.fstat(listener.fileno()).st_ino
        asyncio.get_running_loop().add_reader(listener, self._accept)

    def receive(
        self,
        session: str,
        key: str,
        wanted: Wanted,
        take: Callable[[Sequence[Arrived]], None],
        on_end: Callable[[], None],
    ) -> Intake | None:
        """Receive a topic from all publishers of a session; None if there is no line to it.

        Args:
            session: the id of the session.
            key: the topic's key.
            wanted: the depth and overflow of the deepest queue behind it.
            take: called with the messages that have arrived, the oldest first.
            on_end: called once, after the last message, when the session has gone or the line is broken.
        """
        line = next((each for each in self._lines if each.session == session), None) or self._connect(session)
        return None if line is None else line.receive(key, wanted, take, on_end)

    def routes(self, key: str) -> Sequence[Route]:
        """Return the list of the routes of a topic's key, which changes as readers come and go."""
        return self._routes.setdefault(key, [])

    def send(self, key: str, payload: bytes | Pieces, attachment: bytes, now_ns: int) -> None:
        """Send a message to all readers of a topic's key; a large one is written into shared memory once."""
        routes = self._routes.get(key, ())
        if isinstance(payload, Pieces) and payload.size <= LARGE:
            payload = payload.joined
        if isinstance(payload, bytes) and len(payload) <= LARGE:
            for route in routes:
                route.send(payload, attachment, now_ns)
        elif routes:
            stored = self._stored(payload)
            for route in routes:
                route.send(stored, attachment, now_ns)
            if isinstance(stored, Stored):
                stored.release()

    def read(self) -> None:
        """Accept and read everything that is there now."""
        self._accept()
        for line in tuple(self._lines):
            line.read()

    def finish(self, patience_s: float) -> None:
        """Send what waits, no longer than this, and say what is dropped then."""
        deadline = clock.monotonic() + patience_s
        routes = [route for line in self._lines for route in line.routes]
        for route in routes:
            route.flush()
        while (waiting := [line for line in self._lines if line.waits]) and (left := deadline - clock.monotonic()) > 0:
            poll = select.poll()
            for line in waiting:
                # Of a socket that has room, only what comes back matters.
                poll.register(line, select.POLLIN | (select.POLLOUT if line.is_blocked else 0))
            poll.poll(left * 1000)
            for line in waiting:
                line.read()
                line.go_on()
        for route in routes:
            route.give_up()

    def close(self) -> None:
        """Close all lines, and accept no more."""
        if self._listener is not None:
            asyncio.get_running_loop().remove_reader(self._listener)
            (self._listener.close if is_own(self._listener, self._inode) else self._listener.detach)()
            self._listener = None
            with suppress(OSError):
                os.close(self._spare)
            with suppress(OSError):
                os.unlink(self._path(self._session))  # noqa: PTH108  # the same path went to the kernel
        for line in tuple(self._lines):
            line.close()
        if self._trimming is not None:
            self._trimming.cancel()

    # What a line calls.

    def on_route(self, route: Route) -> None:
        """Note that another process receives a topic."""
        self._routes.setdefault(route.key, []).append(route)
        self._on_route(route.key)

    def on_route_end(self, route: Route, may_read: bool) -> None:  # called by position
        """Note that it does so no more; memory that it may still read is not written any more."""
        self._routes[route.key].remove(route)
        if may_read:
            self._arena = None
        self._on_route(route.key)

    def on_end(self, line: Line, is_faulty: bool) -> None:  # called by position
        """Note that a line has ended."""
        self._lines.remove(line)
        if is_faulty or not line.is_known or line.session in self._broken:
            self._faulty.add(line.session)
        elif self._listener is not None:
            # Where the other process lives, a plugin has closed its descriptor, and nothing else tells it so.
            self._broken.add(line.session)
            self._connect(line.session)

    def _stored(self, payload: bytes | Pieces) -> bytes | Stored:
        """Write a large message into shared memory; return it as bytes if there is no room."""
        if self._arena is None and self._type is socket.SOCK_SEQPACKET:
            with suppress(OSError, AttributeError):  # not every system has such memory
                self._arena = Arena()
        stored = None if self._arena is None else self._arena.store(payload)
        if stored is not None:
            if self._trimming is None:
                self._trimming = asyncio.get_running_loop().call_later(_IDLE_S, self._trim)
            return stored
        return payload.joined if isinstance(payload, Pieces) else payload

    def _trim(self) -> None:
        """Give back memory that no message has needed for a while."""
        self._trimming = None
        if self._arena is not None:
            self._arena.trim()
            if self._arena.written:
                self._trimming = asyncio.get_running_loop().call_later(_IDLE_S, self._trim)

    def _path(self, session: str) -> str:
        return str(self._directory / socket_name(session))

    def _socket(self) -> socket.socket:
        made = socket.socket(socket.AF_UNIX, self._type)
        made.setblocking(False)  # the socket module's signature
        return made

    def _connect(self, session: str) -> Line | None:
        self._check()
        if session in self._faulty:
            return None
        try:
            opened = self._socket()
        except OSError as error:
            self.refusals[session] = f"{error}; see ulimit -n"
            self._faulty.add(session)
            return None
        try:
            opened.connect(self._path(session))
        except OSError as error:  # it is on another machine, in a container of its own, or has just ended
            self.refusals[session] = f"its socket in the run's directory cannot be reached: {error.strerror}"
            opened.close()
            return None
        return self._added(opened, session)

    def _accept(self) -> None:
        while self._listener is not None:
            self._check()
            try:
                opened, _ = self._listener.accept()
            except OSError as error:
                if error.errno not in (EMFILE, ENFILE) or not self._turn_away(self._listener, error):
                    return
                continue
            opened.setblocking(False)  # the socket module's signature
            if (line := self._added(opened, "")) is not None:
                line.read()

    def _turn_away(self, listener: socket.socket, why: OSError) -> bool:
        """Close a connection for which no descriptor is left, so that its reader receives through Zenoh.

        Return whether there was one.
        """
        os.close(self._spare)
        try:
            listener.accept()[0].close()
        except OSError:
            return False
        finally:
            self._spare = os.open(os.devnull, os.O_RDONLY | os.O_CLOEXEC)
        self._log.warning(f"another process receives through Zenoh: {why}; see ulimit -n")
        return True

    def _check(self) -> None:
        """End lines whose descriptor a plugin has closed, before a new socket gets its number."""
        for line in tuple(self._lines):
            line.check()

    def _added(self, opened: socket.socket, session: str) -> Line | None:
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER)
        if hasattr(socket, "SO_PEERCRED"):  # elsewhere the directory's permissions alone keep others out
            _, user, _ = _CREDENTIALS.unpack(
                opened.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size)
            )
            if user != os.geteuid():
                if session:
                    self.refusals[session] = f"it is a process of another user ({user})"
                else:
                    self._log.warning(f"a process of another user ({user}) gets no line to this one")
                opened.close()
                return None
        line = Line(opened, self._session, session, self, self._log)
        self._lines.append(line)
        return line

    def _abandon(self) -> None:
        """Close the copies of the sockets in a process that was forked, which must not write into the memory either."""
        if self._listener is not None:
            self._listener.close()
        for line in self._lines:
            line.abandon()
        self._lines.clear()
        self._arena = None
        for routes in self._routes.values():
            routes.clear()
