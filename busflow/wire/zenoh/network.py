"""Network: the settings by which a machine's session reaches other machines, and the rights of its clients.

A machine's main process is a Zenoh router. It forwards the messages of the machine's other processes to the linked
machines, by TLS with a certificate on both sides. Zenoh's access control checks each message of such a link by the
common name of the certificate. Messages that come through the run's Unix sockets are from this user. Nodes of ROS 2
come by TCP, and may do what ROS 2's keys are for (`access`).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from busflow.launchfile.model.network import TCP, TLS, NetworkAddress, NetworkSpec, Role
from busflow.runner.planning.credentials import Credentials, credentials_of
from busflow.wire.zenoh.access import UNIX, AccessRules
from busflow.wire.zenoh.keys import DOMAIN


@dataclass(frozen=True, slots=True)
class Ros2Network:
    """What a session has in common with nodes of ROS 2: a domain, topics, and addresses of this machine."""

    domain: int
    topics: Sequence[str] = ()
    """Patterns of the topics and services that pass; all without one."""
    listens: Sequence[str] = ("tcp/127.0.0.1:0",)
    """Without the address of a router, it is one of this machine alone, as each session of ROS 2 has: they link there.
    """
    dials: Sequence[str] = ()
    """Address of the router, if there is one already, and then those of the user's other runs in the domain."""
    is_router: bool = False
    """Whether the session stands in for the router that nodes of ROS 2 look for."""

    def __str__(self) -> str:
        at, *_ = self.dials or self.listens
        where = f"this run stands in for their router at {at}" if self.is_router else f"they meet at the router {at}"
        return f"nodes of ROS 2 take part in domain {self.domain}: {where}"


@dataclass(frozen=True, slots=True)
class Network:
    """Addresses, credentials and access rules for the session of one machine."""

    dials: Sequence[NetworkAddress]
    listens: Sequence[NetworkAddress] = ()
    credentials: Credentials | None = None
    machines: Collection[str] = ()
    allow: Mapping[str, Role] | None = None
    """Roles of clients that are no machines, by certificate name; None if no other client can connect."""
    ros2: Ros2Network | None = None

    @classmethod
    def of(cls, spec: NetworkSpec, machine: str) -> Network:
        """Return the network settings of one machine of a launch file."""
        listen = spec.machines[machine].listen
        listens = () if listen is None else (listen,)
        return cls(spec.dialled_by(machine), listens, credentials_of(spec, machine), tuple(spec.machines), spec.allow)

    @property
    def is_router(self) -> bool:
        """Whether the session forwards messages between others, as one that links machines does."""
        return bool(self.dials or self.listens) or (self.ros2 is not None and self.ros2.is_router)

    @property
    def ends(self) -> tuple[Sequence[str], Sequence[str]]:
        """Return the addresses at which the session listens, and those that it connects to."""
        listens, dials = list(map(str, self.listens)), list(map(str, self.dials))
        return (listens, dials) if self.ros2 is None else ([*listens, *self.ros2.listens], [*dials, *self.ros2.dials])

    def settings(self) -> dict[str, Any]:
        """Return the Zenoh settings that a session with others than this machine's processes needs in addition."""
        found: dict[str, Any] = {} if self.credentials is None else _tls(self.credentials)
        if self.allow is not None or self.ros2 is not None:
            found["access_control"] = self._access(self.allow or {})
        return found

    def _access(self, allow: Mapping[str, Role]) -> dict[str, Any]:
        rules = AccessRules(DOMAIN if self.ros2 is None else self.ros2.domain)
        # A link between machines by TCP is on this machine: the check of the launch file refuses any other.
        by_tcp = self.ros2 is None and any(end.protocol == TCP for end in (*self.listens, *self.dials))
        rules.allow_everything("here", (UNIX, TCP) if by_tcp else (UNIX,))
        everything = [*self.machines, *(name for name, role in allow.items() if role is Role.ALL)]
        if everything:
            rules.allow_everything("all", (TLS,), everything)
        if reading := [name for name, role in allow.items() if role is Role.READ]:
            rules.allow_reading("read", reading)
        if self.ros2 is not None:
            rules.allow_ros2(self.ros2.topics)
        return rules.settings()


def _tls(credentials: Credentials) -> dict[str, Any]:
    found: dict[str, Any] = {
        "transport/link/tls/root_ca_certificate": str(credentials.ca),
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/verify_name_on_connect": True,
        # An expired certificate does not cut a working robot's link; it prevents the next start.
        "transport/link/tls/close_link_on_expiration": False,
    }
    for side in ("listen", "connect"):
        found[f"transport/link/tls/{side}_certificate"] = str(credentials.cert)
        found[f"transport/link/tls/{side}_private_key"] = str(credentials.key)
    return found
