"""Lines: those of this process to all others of the run that it can reach."""

from __future__ import annotations

import asyncio
import os
import socket
import struct
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from busflow.runner.own_process import call_in_children
from busflow.wire.line.arena import Arena, Pieces, Stored
from busflow.wire.line.intake import Arrived, Intake
from busflow.wire.line.line import Line
from busflow.wire.line.packets import LARGE, Wanted
from busflow.wire.line.route import Route

if TYPE_CHECKING:
    from busflow.log import Logger

_NAME_DIGITS = 8
_BACKLOG = 128
_CREDENTIALS = struct.Struct("iII")


def socket_name(session: str) -> str:
    """Return the name of a session's socket in the run's directory; it is as short as that of Zenoh's socket."""
    return f"~{session[:_NAME_DIGITS]}"


class Lines:
    """The lines of a process: it connects to whom it wants to receive from, and accepts who wants to receive."""

    def __init__(self, directory: Path, session: str, on_route: Callable[[str], None], log: Logger) -> None:
        """Create lines; nobody reaches them before `begin`.

        Args:
            directory: the run's directory, by a path that leads there in this process.
            session: the id of this process's session.
            on_route: called with a topic's key whenever a reader of it has come or gone.
            log: told why a line breaks, or why there is none.
        """
        self._directory, self._session, self._on_route, self._log = directory, session, on_route, log
        self._listener: socket.socket | None = None
        self._lines: list[Line] = []
        self._routes: dict[str, list[Route]] = {}
        self._arena: Arena | None = None
        call_in_children(self._abandon)

    @property
    def capacity(self) -> int:
        """Bytes of shared memory in which messages of this process lie."""
        return 0 if self._arena is None else self._arena.taken

    @property
    def sessions(self) -> set[str]:
        """The ids of the sessions that have a line to this process."""
        return {line.session for line in self._lines if line.session}

    def begin(self) -> None:
        """Listen in the run's directory, if the system has such sockets."""
        if not hasattr(socket, "SOCK_SEQPACKET"):
            return
        path = str(self._directory / socket_name(self._session))
        try:
            listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            listener.setblocking(False)  # the socket module's signature
            with suppress(FileNotFoundError):
                os.unlink(path)  # noqa: PTH108  # the same path goes to the kernel
            listener.bind(path)
            os.chmod(path, 0o600)  # noqa: PTH101  # as above
            listener.listen(_BACKLOG)
        except OSError as error:
            self._log.warning(f"other processes of the run cannot connect to this one: {error}")
            return
        self._listener = listener
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
        stored = self._stored(payload) if isinstance(payload, Pieces) or len(payload) > LARGE else payload
        for route in tuple(self._routes.get(key, ())):
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

    def close(self) -> None:
        """Close all lines, and accept no more."""
        if self._listener is not None:
            asyncio.get_running_loop().remove_reader(self._listener)
            self._listener.close()
            self._listener = None
            with suppress(OSError):
                (self._directory / socket_name(self._session)).unlink()
        for line in tuple(self._lines):
            line.close()

    # What a line calls.

    def on_hello(self, line: Line) -> None:
        """Note that the session at the other end is known."""

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

    def on_end(self, line: Line) -> None:
        """Note that a line has ended."""
        self._lines.remove(line)

    def _stored(self, payload: bytes | Pieces) -> bytes | Stored:
        """Write a large message into shared memory; return it as bytes if there is no room."""
        if self._arena is None:
            with suppress(OSError):
                self._arena = Arena()
        stored = None if self._arena is None else self._arena.store(payload)
        if stored is not None:
            return stored
        return payload.joined if isinstance(payload, Pieces) else payload

    def _connect(self, session: str) -> Line | None:
        try:
            opened = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        except OSError as error:
            self._log.warning(f"there is no line to another process: {error}")
            return None
        opened.setblocking(False)  # the socket module's signature
        try:
            opened.connect(str(self._directory / socket_name(session)))
        except OSError:  # it is on another machine, in a container of its own, or has just ended
            opened.close()
            return None
        return self._added(opened, session)

    def _accept(self) -> None:
        with suppress(BlockingIOError):
            while self._listener is not None:
                opened, _ = self._listener.accept()
                if (line := self._added(opened, "")) is not None:
                    line.read()

    def _added(self, opened: socket.socket, session: str) -> Line | None:
        _, user, _ = _CREDENTIALS.unpack(opened.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, _CREDENTIALS.size))
        if user != os.geteuid():
            self._log.warning(f"a process of another user ({user}) gets no line to this one")
            opened.close()
            return None
        line = Line(opened, self._session, session, self, self._log)
        self._lines.append(line)
        return line

    def _abandon(self) -> None:
        """Close the copies of the sockets in a process that was forked."""
        if self._listener is not None:
            self._listener.close()
        for line in self._lines:
            line.abandon()
