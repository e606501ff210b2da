"""Access: Zenoh's rules for what each member of a run may send and receive over its link.

Messages that come through the run's Unix sockets are from this user, and may be anything. A machine or a client of
another machine has a certificate, whose common name decides. A node of ROS 2 is known by its link alone: only
ROS 2's keys of the run's domain pass there, and no query about the run itself.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from busflow.launchfile.model.network import TCP, TLS
from busflow.wire.zenoh.keys import GRAPH, QUERY_PREFIX, READ_ONLY_QUERIES

UNIX = "unixsock-stream"
_RECEIVING = ("put", "delete", "reply", "liveliness_token", "declare_queryable")
"""The message kinds that a client only receives from the run, as Zenoh's access control names them."""
_SEARCHES = ("liveliness_query", "declare_liveliness_subscriber")
"""The message kinds by which tokens are looked for."""
_ALL_MESSAGES = (*_RECEIVING, *_SEARCHES, "declare_subscriber", "query")
"""Every message kind that Zenoh's access control knows."""
_BOTH, _INWARDS, _OUTWARDS = ("ingress", "egress"), ("ingress",), ("egress",)


@dataclass(slots=True)
class AccessRules:
    """Rules of one session, all of which allow something; what no rule allows is denied."""

    domain: int
    _rules: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    _subjects: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])
    _policies: list[dict[str, Any]] = field(default_factory=list[dict[str, Any]])

    def allow_everything(self, name: str, protocols: Sequence[str], certificates: Sequence[str] = ()) -> None:
        """Let members with these links, and with these certificates if there are any, do what the run's user may."""
        self._allow(name, protocols, certificates, [_rule(name, _ALL_MESSAGES, _BOTH, self._all_keys)])

    def allow_reading(self, name: str, certificates: Sequence[str]) -> None:
        """Let clients receive everything, send read-only queries, and show a node and its subscriptions."""
        self._allow(name, (TLS,), certificates, list(self._reading()))

    def allow_ros2(self, topics: Sequence[str]) -> None:
        """Let nodes of ROS 2 take part in the topics and services that these patterns match, or in all.

        What they send each other alone, since Lyrical with references to memory in place of bytes, does not come in.
        """
        self._allow("ros2", (TCP,), (), list(self._ros2(topics)))

    def settings(self) -> dict[str, Any]:
        """Return the settings of Zenoh's access control."""
        lists = {"rules": self._rules, "subjects": self._subjects, "policies": self._policies}
        return {"enabled": True, "default_permission": "deny", **lists}

    def _allow(
        self, name: str, protocols: Sequence[str], certificates: Sequence[str], rules: list[dict[str, Any]]
    ) -> None:
        named = {"cert_common_names": list(certificates)} if certificates else {}
        self._subjects.append({"id": name, "link_protocols": list(protocols), **named})
        self._rules += rules
        self._policies.append({"rules": [rule["id"] for rule in rules], "subjects": [name]})

    @property
    def _all_keys(self) -> tuple[str, ...]:
        return f"{self.domain}/**", self._kept, f"{GRAPH}/**", f"{QUERY_PREFIX}/**"

    @property
    def _kept(self) -> str:
        """The keys of the messages that are kept for late joiners."""
        return f"{self.domain}/**/@adv/**"

    def _reading(self) -> Iterator[dict[str, Any]]:
        tokens = (f"{GRAPH}/**", self._kept, f"{QUERY_PREFIX}/**")
        yield _rule("receive", _RECEIVING, _OUTWARDS, self._all_keys)
        yield _rule("subscribe", ("declare_subscriber",), _INWARDS, (f"{self.domain}/**",))
        yield _rule("see-tokens", _SEARCHES, _INWARDS, tokens)
        own = [f"{GRAPH}/*/*/*/*/{kind}/**" for kind in ("NN", "MS")]
        yield _rule("show-tokens", ("liveliness_token",), _INWARDS, own)
        reading = (f"{QUERY_PREFIX}/*/{query}" for query in READ_ONLY_QUERIES)
        yield _rule("query", ("query",), _INWARDS, (self._kept, *reading))

    def _ros2(self, topics: Sequence[str]) -> Iterator[dict[str, Any]]:
        graph = f"{GRAPH}/{self.domain}"
        if not topics:
            yield _rule("ros2", _ALL_MESSAGES, _BOTH, (f"{self.domain}/**", self._kept, f"{graph}/**"))
            own = [f"{self.domain}/**/RIHS01_$*/{key}" for key in ("_buf_cpu", "_buf/*")]
            yield _rule("ros2-own", ("put",), _INWARDS, own) | {"permission": "deny"}
            return
        keys = [_canonical(f"{self.domain}/{_parts(pattern)}/*/*") for pattern in topics]
        ends = [_canonical(f"{graph}/*/*/*/*/*/*/*/{_mangled_parts(pattern)}/**") for pattern in topics]
        yield _rule("ros2", _ALL_MESSAGES, _BOTH, (*keys, *(f"{key}/@adv/**" for key in keys), *ends))
        # A process receives a topic with all that its own run sends under the topic's key.
        yield _rule("ros2-subscribe", ("declare_subscriber",), _OUTWARDS, [_canonical(f"{key}/**") for key in keys])
        yield _rule("ros2-search", _SEARCHES, _BOTH, (f"{graph}/**",))
        yield _rule("ros2-nodes", ("liveliness_token",), _BOTH, (f"{graph}/*/*/*/NN/**",))


def _parts(pattern: str) -> str:
    """Return a pattern of names as a key expression, in which `$*` stands for a part of a chunk.

    >>> _parts("/left_*/**/imu/*")
    'left_$*/**/imu/*'
    """
    return "/".join(part if part in ("*", "**") else part.replace("*", "$*") for part in pattern.strip("/").split("/"))


def _mangled_parts(pattern: str) -> str:
    """Return a pattern as one chunk of a token; it matches deeper names too, as no chunk can leave them out.

    >>> _mangled_parts("/left_*/**/imu")
    '%left_$*%imu'
    """
    return re.sub(r"\*(%?\*)*", "$*", f"/{pattern.strip('/')}".replace("/", "%"))


def _canonical(key: str) -> str:
    """Return the only spelling of a key expression that Zenoh accepts."""
    import zenoh  # a session is about to be opened

    return str(zenoh.KeyExpr.autocanonize(key))


def _rule(name: str, messages: Sequence[str], flows: Sequence[str], keys: Sequence[str]) -> dict[str, Any]:
    rule = {"messages": list(messages), "flows": list(flows), "key_exprs": list(keys)}
    return {"id": name, "permission": "allow", **rule}
