"""A held port is one session's alone, from before it listens there until after it has ended."""

import socket
from contextlib import closing

import pytest

from busflow.wire.zenoh.held_port import HeldPort


def test_sessions_listen_there_one_after_another():
    with closing(HeldPort()) as port:
        host, _, number = port.address.removeprefix("tcp/").rpartition(":")
        for _ in range(2):
            with socket.socket() as session:
                session.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # as Zenoh does
                session.bind((host, int(number)))
                session.listen()


def test_another_program_does_not_get_the_port():
    with closing(HeldPort()) as port, socket.socket() as other, pytest.raises(OSError, match="in use"):
        other.bind(("127.0.0.1", int(port.address.rpartition(":")[2])))
