"""`NetworkSpec`: the machines of a launch file, their addresses, and the participants that may join the run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from ipaddress import IPv4Address, IPv6Address, ip_address

from busflow.launchfile.yaml.value import Origin, StatedPath

NAME = re.compile("[A-Za-z][A-Za-z0-9_-]{0,31}")
"""Valid names of machines and of other participants: the common name of the certificate, and the name of its file."""


class Role(StrEnum):
    """Rights of a certificate's holder."""

    READ = "read"
    """Inspect, and receive topics; not publish, call or set."""
    ALL = "all"
    """The same rights as the user that started the run."""


TLS, TCP = "tls", "tcp"


@dataclass(frozen=True, slots=True)
class NetworkAddress:
    """Network address at which a machine is reached, or listens."""

    protocol: str
    host: str
    port: int
    origin: Origin

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.protocol}/{host}:{self.port}"

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach the address."""
        return self.host == "localhost" if self._address is None else self._address.is_loopback

    @property
    def is_address(self) -> bool:
        """Whether its host is an address, and not a name that machines may resolve differently."""
        return self.host == "localhost" or self._address is not None

    @property
    def is_everywhere(self) -> bool:
        """Whether it stands for all addresses of a machine; no machine can connect to that."""
        return self._address is not None and self._address.is_unspecified

    @property
    def _address(self) -> IPv4Address | IPv6Address | None:
        try:
            return ip_address(self.host)
        except ValueError:
            return None


@dataclass(frozen=True, slots=True)
class MachineSpec:
    """Machine of the run."""

    name: str
    origin: Origin  # its `place` is the machine's key
    connect: NetworkAddress | None = None
    listen: NetworkAddress | None = None
    cert: StatedPath | None = None
    key: StatedPath | None = None


@dataclass(frozen=True, slots=True)
class NetworkSpec:
    """Machines of a run, their certificate authority, and the rights of other participants."""

    machines: Mapping[str, MachineSpec]  # the main one first
    ca: StatedPath | None = None
    allow: Mapping[str, Role] = field(default_factory=dict[str, Role])

    @property
    def ends(self) -> list[NetworkAddress]:
        """Return every address that a machine is reached at, or listens at."""
        return [end for each in self.machines.values() for end in (each.connect, each.listen) if end is not None]

    def dialled_by(self, machine: str) -> list[NetworkAddress]:
        """Return the addresses that a machine connects to.

        Of two machines, the one that the file names first connects to the other, if that one has an address.
        """
        names = list(self.machines)
        own = names.index(machine)
        found: list[NetworkAddress] = []
        for place, other in enumerate(self.machines.values()):
            theirs, ours = other.connect, self.machines[machine].connect
            if theirs is not None and (place > own or (place < own and ours is None)):
                found.append(theirs)
        return found

    def listens(self, machine: str) -> bool:
        """Return whether a machine accepts connections."""
        return self.machines[machine].listen is not None
