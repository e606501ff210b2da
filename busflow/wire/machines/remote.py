"""Remote: a run on other machines, joined with a certificate that its launch file admits."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from busflow.clock import SystemClock
from busflow.errors import InspectionUnavailable, LaunchError, NoSuchRun, NotAllowed, Severity
from busflow.launchfile.load.load import examine
from busflow.launchfile.model.network import TLS, NetworkAddress, NetworkSpec, Role
from busflow.runner.planning.credentials import Credentials, credential_faults
from busflow.text import did_you_mean, printable
from busflow.wire.machines.probe import why_not_linked
from busflow.wire.zenoh.network import Network
from busflow.wire.zenoh.run_directory import AT, RunCard
from busflow.wire.zenoh.run_lock import RunLock
from busflow.wire.zenoh.session import open_remote

if TYPE_CHECKING:
    import zenoh


@dataclass(frozen=True, slots=True)
class RemoteRun:
    """A run whose machines a launch file names."""

    name: str
    """The value of `--run`."""
    identity: str
    file: Path
    role: Role
    """The rights of a client with this identity."""
    credentials: Credentials | None
    addresses: tuple[tuple[str, NetworkAddress], ...]
    """Each reachable machine and its address."""
    card: RunCard = field(default=RunCard("", 0, 0))
    """Description of the run; empty until the run has been asked."""

    def open(self, patience_s: float) -> zenoh.Session:
        """Join the run.

        Raises:
            InspectionUnavailable: no machine can be reached, or none trusts the certificate; it says why.
        """
        network = Network([address for _, address in self.addresses], credentials=self.credentials)
        try:
            return open_remote(network, patience_s=patience_s)
        except InspectionUnavailable as error:
            reasons = asyncio.run(self._reasons()) or str(error)
            raise InspectionUnavailable(f"no machine of {printable(self.file)} is reached: {reasons}") from None

    def is_alive(self, session: zenoh.Session) -> bool:
        """Return whether a machine of the run is still linked, for a client that has joined by this session."""
        return bool(session.info.routers_zid())

    def lock(self) -> RunLock:
        """Return the lock of a run that is not on this machine: nothing is known of it."""
        return RunLock(None)

    def require(self, what: str) -> None:
        """Check that this identity may do more than look.

        Raises:
            NotAllowed: it may not; the run would not answer.
        """
        if self.role is not Role.ALL:
            raise NotAllowed(
                f"{self.identity} may look, and not {what}; network: {{allow: {{{self.identity}: all}}}} in "
                f"{printable(self.file)} changes that"
            )

    def answered(self, answers: Iterable[Mapping[str, object]]) -> RemoteRun:
        """Return the run with the description in its processes' answers to `run`."""
        words = RunCard.__dataclass_fields__.keys() - {"packages"}  # folders of another machine mean nothing here
        for answer in answers:
            return replace(self, card=RunCard(**{name: answer[name] for name in words if name in answer}))  # pyright: ignore[reportArgumentType]  # as its process made it
        return self

    async def _reasons(self) -> str:
        reasons = [f"{name}: {await why_not_linked(each, self.credentials, name)}" for name, each in self.addresses]
        return "; ".join(each for each in reasons if not each.endswith(": "))


def remote_run(text: str) -> RemoteRun:
    """Return the run that `viewer@robot.yaml` names: the launch file's, joined with that certificate.

    Raises:
        NoSuchRun: the file names no machine that can be reached, or admits no such identity.
        LaunchError: the file cannot be read, or the certificate will not do.
    """
    identity, _, stated = text.partition(AT)
    file = Path(stated)
    description, problems = examine(file)
    network = None if description is None else description.network
    if network is None:
        if errors := [problem for problem in problems if problem.severity is Severity.ERROR]:
            raise LaunchError(errors)  # the network section may be among what could not be read
        raise NoSuchRun(f"{printable(file)} has no network section: its runs are reached from their own machine alone")
    if identity not in network.allow and identity not in network.machines:
        known = [*network.allow, *network.machines]
        raise NoSuchRun(
            f"{printable(file)} admits no one called {printable(identity)!r}; {did_you_mean(identity, known)}"
        )
    addresses = tuple(_addresses(network))
    if not addresses:
        raise NoSuchRun(f"{printable(file)} does not say where a machine is reached; add connect to one of them")
    credentials = _credentials(network, identity) if any(each.protocol == TLS for _, each in addresses) else None
    return RemoteRun(text, identity, file, network.allow.get(identity, Role.ALL), credentials, addresses)


def _addresses(network: NetworkSpec) -> Iterator[tuple[str, NetworkAddress]]:
    for name, machine in network.machines.items():
        address = machine.connect or machine.listen
        if address is not None and not address.is_everywhere:
            yield name, address


def _credentials(network: NetworkSpec, identity: str) -> Credentials | None:
    """Return the credentials of an identity: a machine's own, otherwise the files of its name beside the `ca`."""
    if network.ca is None:
        return None
    machine = network.machines.get(identity)
    cert, key = (None, None) if machine is None else (machine.cert, machine.key)
    cert = cert or replace(network.ca, path=network.ca.path.with_name(f"{identity}.pem"))
    key = key or replace(network.ca, path=network.ca.path.with_name(f"{identity}.key"))
    found = list(credential_faults(identity, (network.ca, cert, key), [], SystemClock().now()))
    if errors := [problem for problem in found if problem.severity is Severity.ERROR]:
        raise LaunchError(errors)
    return Credentials(network.ca.path, cert.path, key.path)
