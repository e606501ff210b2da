"""HeldPort: a port of this machine's own address, known before a session listens there and kept for its restarts."""

from __future__ import annotations

import socket


class HeldPort:
    """A TCP port at which no other program can listen, nor be given it by the system, until it is closed."""

    def __init__(self) -> None:
        self._socket = socket.socket()
        # Zenoh sets the same option, so it can listen at a port that this socket has without listening there.
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.bind(("127.0.0.1", 0))
        self.address: str = f"tcp/127.0.0.1:{self._socket.getsockname()[1]}"
        """The port's address, as Zenoh writes it."""

    def close(self) -> None:
        """Let go of the port; a session that listens there goes on."""
        self._socket.close()
