"""Network: the settings by which a machine's session reaches other machines, and the rights of its clients.

A machine's main process is a Zenoh router. It forwards the messages of the machine's other processes to the linked
machines, by TLS with a certificate on both sides. Zenoh's access control checks each message of such a link by the
common name of the certificate. Messages that come through the run's Unix sockets are from this user.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from busflow.launchfile.check.credentials import Credentials, credentials_of
from busflow.launchfile.model.network import TCP, TLS, NetworkAddress, NetworkSpec, Role
from busflow.wire.zenoh.keys import DOMAIN, GRAPH, QUERY_PREFIX, READ_ONLY_QUERIES

_RETRY = {"period_init_ms": 250, "period_max_ms": 2000, "period_increase_factor": 2.0}
"""The times between attempts to connect to a missing machine."""
_RECEIVING = ("put", "delete", "reply", "liveliness_token", "declare_queryable")
"""The message kinds that a client only receives from the run, as Zenoh's access control names them."""
_ALL_MESSAGES = (*_RECEIVING, "declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber")
"""Every message kind that Zenoh's access control knows."""
_DATA, _KEPT, _GRAPH, _QUERIES = f"{DOMAIN}/**", f"{DOMAIN}/**/@adv/**", f"{GRAPH}/**", f"{QUERY_PREFIX}/**"
_ALL_KEYS = (_DATA, _KEPT, _GRAPH, _QUERIES)


@dataclass(frozen=True, slots=True)
class Network:
    """Addresses, credentials and access rules for the session of one machine."""

    dials: Sequence[NetworkAddress]
    listens: Sequence[NetworkAddress] = ()
    credentials: Credentials | None = None
    machines: Collection[str] = ()
    allow: Mapping[str, Role] | None = None
    """Roles of clients that are no machines, by certificate name; None if no other client can connect."""

    @classmethod
    def of(cls, spec: NetworkSpec, machine: str) -> Network:
        """Return the network settings of one machine of a launch file."""
        listen = spec.machines[machine].listen
        listens = () if listen is None else (listen,)
        return cls(spec.dialled_by(machine), listens, credentials_of(spec, machine), tuple(spec.machines), spec.allow)

    def settings(self) -> dict[str, Any]:
        """Return the Zenoh settings that a session with other machines needs in addition."""
        found: dict[str, Any] = {"connect/retry": _RETRY}
        if self.credentials is not None:
            found |= _tls(self.credentials)
        if self.allow is not None:
            found["access_control"] = self._access(self.allow)
        return found

    def _access(self, allow: Mapping[str, Role]) -> dict[str, Any]:
        ways = ["unixsock-stream"]
        if any(end.protocol == TCP for end in (*self.listens, *self.dials)):
            ways.append(TCP)  # only on this machine: the check of the launch file refuses any other
        everything = [*self.machines, *(name for name, role in allow.items() if role is Role.ALL)]
        reading = [name for name, role in allow.items() if role is Role.READ]
        subjects: list[dict[str, Any]] = [{"id": "here", "link_protocols": ways}]
        subjects.append({"id": "all", "link_protocols": [TLS], "cert_common_names": everything})
        policies = [{"rules": ["all"], "subjects": ["here", "all"]}]
        rules = [_rule("all", _ALL_MESSAGES, ("ingress", "egress"), _ALL_KEYS)]
        if reading:
            subjects.append({"id": "read", "link_protocols": [TLS], "cert_common_names": reading})
            reads = list(_reading())
            rules += reads
            policies.append({"rules": [rule["id"] for rule in reads], "subjects": ["read"]})
        lists = {"rules": rules, "subjects": subjects, "policies": policies}
        return {"enabled": True, "default_permission": "deny", **lists}


def _reading() -> Iterator[dict[str, Any]]:
    """Let read-only clients receive everything, send read-only queries, and show a node and its subscriptions."""
    inwards, outwards = ("ingress",), ("egress",)
    yield _rule("receive", _RECEIVING, outwards, _ALL_KEYS)
    yield _rule("subscribe", ("declare_subscriber",), inwards, (_DATA,))
    yield _rule("see-tokens", ("liveliness_query", "declare_liveliness_subscriber"), inwards, (_GRAPH, _KEPT, _QUERIES))
    own = [f"{GRAPH}/*/*/*/*/{kind}/**" for kind in ("NN", "MS")]
    yield _rule("show-tokens", ("liveliness_token",), inwards, own)
    reading = (f"{QUERY_PREFIX}/*/{query}" for query in READ_ONLY_QUERIES)
    yield _rule("query", ("query",), inwards, (_KEPT, *reading))


def _rule(name: str, messages: Sequence[str], flows: Sequence[str], keys: Sequence[str]) -> dict[str, Any]:
    rule = {"messages": list(messages), "flows": list(flows), "key_exprs": list(keys)}
    return {"id": name, "permission": "allow", **rule}


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
