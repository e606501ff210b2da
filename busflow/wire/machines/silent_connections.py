"""`silent_connections`: connections to a TCP port that have sent nothing, as Linux lists them.

Zenoh shows a connection only once it has introduced itself. One that never does waits in the kernel or in Zenoh's
handshake, and keeps others out meanwhile. The kernel counts the bytes of each, which all may ask for, as `ss` does.
"""

from __future__ import annotations

import errno
import socket
import struct
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from ipaddress import ip_address

_HEADER = struct.Struct("=IHHII")  # nlmsghdr: length, type, flags, sequence, port
_REQUEST = struct.Struct("=BBBxI48x")  # inet_diag_req_v2: family, protocol, extensions, states, socket
_ENTRY_SIZE = 72  # inet_diag_msg: family, state, … ; from 4 on local and remote port, then local and remote address
_PORT = struct.Struct(">H")
_ATTRIBUTE = struct.Struct("=HH")  # rtattr: length, type
_LAST_RECEIVED, _LAST_AT = struct.Struct("=I"), 52  # tcp_info.tcpi_last_data_recv, ms; at first, since the connection
_BYTES_RECEIVED, _BYTES_AT = struct.Struct("=Q"), 128  # tcp_info.tcpi_bytes_received

_SOCK_DIAG = 4
_BY_FAMILY, _DUMP, _ERROR, _DONE = 20, 0x301, 2, 3
_INFO = 2
"""The attribute and extension that hold `tcp_info`."""
_ESTABLISHED = 1


@dataclass(frozen=True, slots=True)
class SilentConnection:
    """A connection that has sent no byte."""

    peer: str
    """The address that it comes from."""
    silent_s: float


def silent_connections(port: int, *, silent_s: float = 1.0) -> tuple[SilentConnection, ...] | None:
    """Return the connections to a port of this machine that have sent nothing, the longest silent first.

    Args:
        port: The port.
        silent_s: How long a connection must have been silent: one that begins has sent nothing either.

    Returns:
        None where it cannot be known: on another system than Linux, or where the kernel does not say.
    """
    try:
        found = [each for family in (socket.AF_INET, socket.AF_INET6) for each in _connections(family, port)]
    except OSError:
        return None
    silent = [each for each in found if each.silent_s >= silent_s]
    return tuple(sorted(silent, key=lambda each: -each.silent_s))


def _connections(family: int, port: int) -> Iterator[SilentConnection]:
    """Yield the connections to a port that have sent nothing so far."""
    if sys.platform != "linux":
        raise OSError(errno.ENOSYS, "only Linux lists sockets in this way")
    request = _REQUEST.pack(family, socket.IPPROTO_TCP, 1 << (_INFO - 1), 1 << _ESTABLISHED)
    with socket.socket(socket.AF_NETLINK, socket.SOCK_DGRAM, _SOCK_DIAG) as kernel:
        kernel.settimeout(1.0)
        kernel.send(_HEADER.pack(_HEADER.size + len(request), _BY_FAMILY, _DUMP, 1, 0) + request)
        while True:
            answer, place = kernel.recv(1 << 16), 0
            while place < len(answer):
                length, kind, *_ = _HEADER.unpack_from(answer, place)
                if kind == _DONE:
                    return
                if kind == _ERROR:
                    raise OSError(errno.EOPNOTSUPP, "the kernel does not list its sockets")
                entry = answer[place + _HEADER.size : place + length]
                if _PORT.unpack_from(entry, 4) == (port,) and (silent_s := _silent_s(entry)) is not None:
                    peer = ip_address(entry[24:28] if family == socket.AF_INET else entry[24:40])
                    yield SilentConnection(str(getattr(peer, "ipv4_mapped", None) or peer), silent_s)
                place += (length + 3) & ~3


def _silent_s(entry: bytes) -> float | None:
    """Return how long a connection has been silent; None if it has sent something, or the kernel does not count it."""
    place = _ENTRY_SIZE
    while place + _ATTRIBUTE.size <= len(entry):
        length, kind = _ATTRIBUTE.unpack_from(entry, place)
        info = entry[place + _ATTRIBUTE.size : place + length]
        if kind == _INFO and len(info) >= _BYTES_AT + _BYTES_RECEIVED.size:
            (received,), (last_ms,) = (
                _BYTES_RECEIVED.unpack_from(info, _BYTES_AT),
                _LAST_RECEIVED.unpack_from(info, _LAST_AT),
            )
            return None if received else last_ms / 1000
        place += max(_ATTRIBUTE.size, (length + 3) & ~3)
    return None
