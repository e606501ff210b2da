"""The probe names the reason why a machine is not linked, from one real connection to it."""

import asyncio
import socket
import threading
from collections.abc import AsyncGenerator, Awaitable, Callable
from contextlib import asynccontextmanager, closing, suppress
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import pytest

from busflow.launchfile.model.network import TCP, TLS, NetworkAddress
from busflow.launchfile.yaml.value import Origin, StatedBy
from busflow.runner.planning.credentials import Credentials
from busflow.wire.machines import certificates
from busflow.wire.machines.certificates import Authority
from busflow.wire.machines.probe import why_not_linked
from tests.golden import Golden

pytestmark = pytest.mark.asyncio  # sockets and TLS: no virtual time

HOST = "127.0.0.1"
MASK = {f"{HOST}:\\d+": f"{HOST}:PORT", "(should|authority|here): .*": r"\1: REASON OF THE SYSTEM"}
Why = Callable[..., Awaitable[None]]


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


@pytest.fixture
def why(golden: Golden) -> Callable[..., Awaitable[None]]:
    """Compares the reason that the probe names."""

    async def why(end: NetworkAddress, own: Credentials | None, machine: str = "arm") -> None:
        golden(await why_not_linked(end, own, machine), mask=MASK)

    return why


@pytest.mark.parametrize(
    ("shown", "machine"), [("arm", "arm"), ("arm", "leg"), ("elsewhere", "elsewhere"), ("other/arm", "arm")]
)
async def test_what_a_machine_shows_is_checked(
    authority: Authority, why: Why, tmp_path: Path, shown: str, machine: str
):
    authority.add("elsewhere", addresses=["192.0.2.7"])
    Authority.new(tmp_path / "other").add("arm", addresses=[HOST])
    path = tmp_path / ("" if "/" in shown else "certs") / shown
    own = Credentials(path.parent / "ca.pem", path.with_suffix(".pem"), path.with_suffix(".key"))
    async with listening(tls(own)) as end:
        await why(end, credentials(authority, "main"), machine)


async def test_our_untrusted_certificate_is_named(authority: Authority, why: Why, tmp_path: Path):
    other = Authority.new(tmp_path / "other")
    other.add("main")
    ours = replace(credentials(other, "main"), ca=authority.folder / "ca.pem")
    async with listening(tls(credentials(authority, "arm"))) as end:
        await why(end, ours)


@pytest.mark.parametrize("expired", ["arm", "main"])
async def test_an_expired_certificate_is_named(
    authority: Authority, why: Why, monkeypatch: pytest.MonkeyPatch, expired: str
):
    monkeypatch.setattr(certificates, "_SKEW", timedelta(days=3))
    authority.add(expired, addresses=[HOST], days=-1, replace=True)
    async with listening(tls(credentials(authority, "arm"))) as end:
        await why(end, credentials(authority, "main"))


async def test_without_encryption_nothing_is_checked():
    async with listening(reading, TCP) as end:
        assert await why_not_linked(end, None, "arm") == ""


async def test_an_address_without_a_machine_is_named(authority: Authority, why: Why):
    with closing(socket.socket()) as unused:
        unused.bind((HOST, 0))
        await why(address(unused.getsockname()[1]), None)
    async with listening(hanging_up, TCP) as end:
        await why(end, None)
    async with listening(greeting) as end:
        await why(end, credentials(authority, "main"))
    await why(replace(address(7447), host="no host"), None)
