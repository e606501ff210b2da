"""Network: which machines a launch file names, where each is reached and listens, and who else may join."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from ipaddress import IPv4Address, IPv6Address, ip_address
from pathlib import Path

from busflow.launchfile.yaml.value import Origin

NAME = re.compile("[A-Za-z][A-Za-z0-9_-]{0,31}")
"""What machines and those that join a run may be called: the common name of their certificate, and its file's name."""


class Role(StrEnum):
    """What a certificate lets do."""

    READ = "read"
    """Look, and receive topics; not publish, call or set."""
    ALL = "all"
    """All that who started the run may do."""


TLS, TCP = "tls", "tcp"


@dataclass(frozen=True, slots=True)
class NetworkAddress:
    """Where a machine is reached, or listens."""

    protocol: str
    host: str
    port: int
    origin: Origin

    def __str__(self) -> str:
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.protocol}/{host}:{self.port}"

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine can reach it."""
        return self.host == "localhost" if self._address is None else self._address.is_loopback

    @property
    def is_address(self) -> bool:
        """Whether its host is an address, and not a name that each machine may take for another one."""
        return self.host == "localhost" or self._address is not None

    @property
    def is_everywhere(self) -> bool:
        """Whether it stands for all addresses of a machine, which nobody can connect to."""
        return self._address is not None and self._address.is_unspecified

    @property
    def _address(self) -> IPv4Address | IPv6Address | None:
        try:
            return ip_address(self.host)
        except ValueError:
            return None


@dataclass(frozen=True, slots=True)
class StatedFile:
    """A file that a launch file names, and where it does."""

    path: Path
    origin: Origin


@dataclass(frozen=True, slots=True)
class MachineSpec:
    """A machine of the run."""

    name: str
    origin: Origin  # its `place` is the machine's key
    connect: NetworkAddress | None = None
    listen: NetworkAddress | None = None
    cert: StatedFile | None = None
    key: StatedFile | None = None


@dataclass(frozen=True, slots=True)
class NetworkSpec:
    """All machines of a run and what lets others join it."""

    machines: Mapping[str, MachineSpec]  # the main one first
    ca: StatedFile | None = None
    allow: Mapping[str, Role] = field(default_factory=dict[str, Role])

    def dialled_by(self, machine: str) -> list[NetworkAddress]:
        """Where a machine connects to: of each two, the first that the file names dials the other, if it can."""
        names = list(self.machines)
        own = names.index(machine)
        found: list[NetworkAddress] = []
        for place, other in enumerate(self.machines.values()):
            theirs, ours = other.connect, self.machines[machine].connect
            if theirs is not None and (place > own or (place < own and ours is None)):
                found.append(theirs)
        return found

    def listens(self, machine: str) -> bool:
        """Whether anybody is to connect to a machine."""
        return self.machines[machine].listen is not None
