"""The probe names the reason why a machine is not linked, from one real connection to it."""

import asyncio
import re
import socket
import threading
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager, closing, suppress
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest

from busflow.launchfile.check.credentials import Credentials
from busflow.launchfile.model.network import TCP, TLS, NetworkAddress
from busflow.launchfile.yaml.value import Origin, StatedBy
from busflow.wire.machines import certificates
from busflow.wire.machines.certificates import Authority
from busflow.wire.machines.probe import why_not_linked

pytestmark = pytest.mark.asyncio  # sockets and TLS: no virtual time

HOST = "127.0.0.1"


@pytest.fixture
def authority(tmp_path: Path) -> Authority:
    made = Authority.new(tmp_path / "certs")
    made.add("main")
    made.add("arm", addresses=[HOST])
    return made


def credentials(authority: Authority, name: str) -> Credentials:
    return Credentials(authority.folder / "ca.pem", authority.folder / f"{name}.pem", authority.folder / f"{name}.key")


def address(port: int, protocol: str = TLS) -> NetworkAddress:
    return NetworkAddress(protocol, HOST, port, Origin(StatedBy.CALLER))


@asynccontextmanager
async def listening(serve: Callable[[socket.socket], object], protocol: str = TLS) -> AsyncGenerator[NetworkAddress]:
    """The address of a program that serves one connection so."""
    with socket.create_server((HOST, 0)) as server:

        def accept() -> None:
            connection, _ = server.accept()
            with connection, suppress(OSError):  # what goes wrong with the peer is what the peer reports
                serve(connection)

        thread = threading.Thread(target=accept)
        thread.start()
        try:
            yield address(server.getsockname()[1], protocol)
        finally:
            await asyncio.to_thread(thread.join, 60)


def tls(shown: Credentials) -> Callable[[socket.socket], object]:
    """A machine with these credentials, which reads until its peer has gone."""

    def serve(connection: socket.socket) -> None:
        with shown.context(server=True).wrap_socket(connection, server_side=True) as secure:
            secure.recv(1)

    return serve


def reading(connection: socket.socket) -> None:
    connection.recv(1)


def hanging_up(connection: socket.socket) -> None:
    connection.shutdown(socket.SHUT_RDWR)


def greeting(connection: socket.socket) -> None:
    connection.sendall(b"220 mail.example ESMTP\r\n")
    connection.recv(1)


@pytest.mark.parametrize(
    ("shown", "machine", "reason"),
    [
        ("arm", "arm", "^$"),
        ("arm", "leg", f"{HOST}:.* is arm, not leg"),
        ("elsewhere", "elsewhere", f"is not for {HOST}: .*--replace --address {HOST}"),
        ("other/arm", "arm", "not one of our authority"),
    ],
)
async def test_what_a_machine_shows_is_checked(
    authority: Authority, tmp_path: Path, shown: str, machine: str, reason: str
):
    authority.add("elsewhere", addresses=["192.0.2.7"])
    Authority.new(tmp_path / "other").add("arm", addresses=[HOST])
    path = tmp_path / ("" if "/" in shown else "certs") / shown
    own = Credentials(path.parent / "ca.pem", path.with_suffix(".pem"), path.with_suffix(".key"))
    async with listening(tls(own)) as end:
        assert re.search(reason, await why_not_linked(end, credentials(authority, "main"), machine))


async def test_without_encryption_nothing_is_checked():
    async with listening(reading, TCP) as end:
        assert await why_not_linked(end, None, "arm") == ""


async def test_our_untrusted_certificate_is_named(authority: Authority, tmp_path: Path):
    other = Authority.new(tmp_path / "other")
    other.add("main")
    ours = replace(credentials(other, "main"), ca=authority.folder / "ca.pem")
    async with listening(tls(credentials(authority, "arm"))) as end:
        reason = await why_not_linked(end, ours, "arm")
    assert reason == "it does not trust our certificate, which another authority than its own has made"


@pytest.mark.parametrize(
    ("expired", "reason"), [("arm", "its certificate has expired"), ("main", "our certificate has expired")]
)
async def test_an_expired_certificate_is_named(
    authority: Authority, monkeypatch: pytest.MonkeyPatch, expired: str, reason: str
):
    monkeypatch.setattr(certificates, "_SKEW", timedelta(days=3))
    authority.add(expired, addresses=[HOST], days=-1, replace=True)
    async with listening(tls(credentials(authority, "arm"))) as end:
        assert await why_not_linked(end, credentials(authority, "main"), "arm") == reason


async def test_a_closed_port_is_named():
    with closing(socket.socket()) as unused:
        unused.bind((HOST, 0))
        end = address(unused.getsockname()[1])
        assert await why_not_linked(end, None, "arm") == (
            f"nothing listens at {end}: its run has not started, or listens elsewhere"
        )


async def test_a_listener_that_hangs_up_is_named():
    async with listening(hanging_up, TCP) as end:
        assert await why_not_linked(end, None, "arm") == f"what listens at {end} ends the connection"


async def test_a_listener_without_tls_is_named(authority: Authority):
    async with listening(greeting) as end:
        reason = await why_not_linked(end, credentials(authority, "main"), "arm")
    assert reason.startswith("what listens there does not speak TLS as it should: ")


async def test_an_unknown_host_is_named():
    end = replace(address(7447), host="no host")
    assert (await why_not_linked(end, None, "arm")).startswith("no host is not known here: ")
