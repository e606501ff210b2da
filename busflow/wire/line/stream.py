"""Stream: packets on a socket that knows none, as on macOS. A packet's size stands before it, in four bytes."""

from __future__ import annotations

import socket
import struct
from collections.abc import Callable

from busflow.errors import MalformedMessage
from busflow.wire.line.packets import MOST_BYTES

_SIZE = struct.Struct("<I")
_AT_ONCE = 1 << 18


class PacketStream:
    """A stream socket with the methods of a packet socket that a line calls."""

    def __init__(self, opened: socket.socket, on_rest: Callable[[], None]) -> None:
        """Create packets on a connected socket.

        Args:
            opened: the socket.
            on_rest: called when a packet has left in part; `flush` is to be called once the kernel has room.
        """
        self._socket, self._on_rest = opened, on_rest
        self._rest = b""
        """The end of the packet that has left in part."""
        self._arrived, self._at = b"", 0
        """The bytes that have arrived, and how many of them were returned."""

    def send(self, packet: bytes) -> None:
        """Send a packet.

        Raises:
            BlockingIOError: The kernel has no room, or the end of the one before has not left yet.
        """
        self.flush()
        if self._rest:
            raise BlockingIOError
        self._send(_SIZE.pack(len(packet)) + packet)

    def flush(self) -> None:
        """Send the end of a packet that has left in part, as far as the kernel has room."""
        if self._rest:
            self._send(self._rest)

    def _send(self, data: bytes) -> None:
        try:
            count = self._socket.send(data)
        except BlockingIOError:
            if not self._rest:
                raise
            count = 0
        self._rest = data[count:]
        if self._rest:
            self._on_rest()

    def recv(self, _most: int) -> bytes:
        """Return the next packet; none if the other end has closed the stream.

        Raises:
            BlockingIOError: It has not arrived whole.
            MalformedMessage: It is too large.
        """
        while (packet := self._next()) is None:
            data = self._socket.recv(_AT_ONCE)
            if not data:
                return b""
            self._arrived, self._at = self._arrived[self._at :] + data, 0
        return packet

    def _next(self) -> bytes | None:
        if len(self._arrived) < self._at + _SIZE.size:
            return None
        (size,) = _SIZE.unpack_from(self._arrived, self._at)
        if not 0 < size < MOST_BYTES:
            raise MalformedMessage(f"a packet has less than {MOST_BYTES} bytes; got {size}")
        start = self._at + _SIZE.size
        if len(self._arrived) < start + size:
            return None
        self._at = start + size
        return self._arrived[start : self._at]
