"""Connections that have sent nothing, as the kernel lists them."""

import socket
import sys

import pytest

from busflow.wire.machines.silent_connections import silent_connections

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="only Linux lists the connections of other processes")


@pytest.mark.parametrize(("family", "host"), [(socket.AF_INET, "127.0.0.1"), (socket.AF_INET6, "::1")])
def test_only_connections_that_sent_nothing_are_listed(family, host):
    with (
        socket.create_server((host, 0), family=family) as server,
        socket.create_server((host, 0), family=family) as other,
    ):
        port = server.getsockname()[1]
        with (
            socket.create_connection((host, port)),
            socket.create_connection((host, port)) as speaker,
            socket.create_connection((host, other.getsockname()[1])),
        ):
            speaker.sendall(b"x")
            found = silent_connections(port, silent_s=0.0)
            assert found is not None
            assert [each.peer for each in found] == [host]
            assert silent_connections(port, silent_s=3600.0) == ()


def test_ipv4_peer_of_ipv6_server_keeps_its_address():
    with socket.create_server(("::", 0), family=socket.AF_INET6, dualstack_ipv6=True) as server:
        port = server.getsockname()[1]
        with socket.create_connection(("127.0.0.1", port)):
            found = silent_connections(port, silent_s=0.0)
            assert [each.peer for each in found or ()] == ["127.0.0.1"]


def test_no_count_on_other_systems(monkeypatch):
    monkeypatch.setattr(sys, "platform", "darwin")
    assert silent_connections(7447) is None
