"""The graph of a run seen from outside: nodes and topics, from the tokens and answers of its processes.

Tokens say which node is on which topic, for ROS 2's nodes as for ours; the answers of busflow's processes add the
counts, where each endpoint is declared and what state a node is in. Pure: no session, no clock.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from busflow.bus.names import absolute_name, is_hidden
from busflow.errors import MalformedMessage, NoSuchTarget
from busflow.text import did_you_mean, printable
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import WireQoS, from_text

LOGGER_SERVICES = frozenset(f"rcl_interfaces/srv/{verb}LoggerLevels" for verb in ("Get", "Set"))
"""The types of the services for log levels, which every node has, and which are listed only on request."""


@dataclass(frozen=True, slots=True)
class EndView:
    """One endpoint of a topic or service."""

    token: Token
    qos: WireQoS
    details: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Its process's answer: the ledger's line or the count, `origin`, `qos`; empty for other programs than busflow."""

    @property
    def node(self) -> str:
        """The full name of its node."""
        return self.token.node_name


@dataclass(frozen=True, slots=True)
class TopicView:
    """A topic and its endpoints."""

    name: str
    types: tuple[str, ...]
    """Its types; more than one is a mistake."""
    publishers: tuple[EndView, ...]
    subscriptions: tuple[EndView, ...]
    details: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """A process's answer about it: `published`, `hash`, `encoding`, `kept`, `external`, `gone`."""

    @property
    def type(self) -> str:
        """Its type, or those that are in conflict."""
        return ", ".join(self.types)

    @property
    def kinds(self) -> tuple[tuple[str, str | None], ...]:
        """Its types, each with every hash that an endpoint's token or, without endpoints, the run states; else None."""
        ends = (*self.publishers, *self.subscriptions)
        kinds = dict.fromkeys((each.token.type, each.token.known_hash) for each in ends)
        stated = {name for name, type_hash in kinds if type_hash}
        found = tuple((name, type_hash) for name, type_hash in kinds if type_hash or name not in stated)
        return found or tuple((name, self.details.get("hash")) for name in self.types)

    @property
    def hidden(self) -> bool:
        """Whether it is shown only on request."""
        return is_hidden(self.name)


@dataclass(frozen=True, slots=True)
class NodeView:
    """A node and its endpoints."""

    name: str
    publishers: tuple[EndView, ...]
    subscriptions: tuple[EndView, ...]
    services: tuple[EndView, ...]
    clients: tuple[EndView, ...]
    details: Mapping[str, Any] = field(default_factory=dict[str, Any])
    """Its process's answer: `plugin`, `state`, `failures`, `process`, `pid`."""

    @property
    def hidden(self) -> bool:
        """Whether it is shown only on request."""
        return is_hidden(self.name)


@dataclass(frozen=True, slots=True)
class GraphView:
    """The nodes and topics of a run, by name."""

    nodes: Mapping[str, NodeView]
    topics: Mapping[str, TopicView]
    services: Mapping[str, TopicView]
    """A service has its servers where a topic has publishers, and its clients where it has subscriptions."""
    processes: Sequence[Mapping[str, Any]] = ()
    """The answer of each process to `graph`, of which the views above are made; its timers and inbox are only here."""

    def topic(self, name: str) -> TopicView:
        """Return the topic of a name, whose leading slash may be left out.

        Raises:
            NoSuchTarget: there is none; the message names the nearest.
        """
        return _named(name, self.topics, "topic")

    def service(self, name: str) -> TopicView:
        """Return the service of a name, whose leading slash may be left out.

        Raises:
            NoSuchTarget: there is none; the message names the nearest.
        """
        return _named(name, self.services, "service")

    def node(self, name: str) -> NodeView:
        """Return the node of a name, whose leading slash may be left out.

        Raises:
            NoSuchTarget: there is none; the message names the nearest.
        """
        full = absolute_name(name)
        if full not in self.nodes and full in self.programs:
            shown = printable(full)
            fix = f"busflow ps shows it, and busflow log --node {shown} what it prints"
            raise NoSuchTarget(f"{shown} is a program, not a node: {fix}")
        return _named(name, self.nodes, "node")

    @property
    def programs(self) -> frozenset[str]:
        """The full names of the programs that the run has started."""
        return frozenset(each["program"] for process in self.processes for each in process.get("programs", ()))


def view(tokens: Iterable[Token], answers: Sequence[Mapping[str, Any]]) -> GraphView:
    """Return the graph that tokens and the processes' answers to `graph` describe together."""
    described = _Answers(answers)
    tokens = sorted(tokens, key=lambda token: (token.topic, token.node_name, token.entity_id))
    ends: dict[TokenKind, list[EndView]] = {kind: [] for kind in TokenKind}
    for token in tokens:
        if token.kind is not TokenKind.NODE:
            ends[token.kind].append(EndView(token, _qos(token), described.take(token)))
    names = {token.node_name for token in tokens} | set(described.nodes)
    nodes = {name: _node(name, ends, described.nodes.get(name, {})) for name in sorted(names)}
    topics = _topics(ends[TokenKind.PUBLISHER], ends[TokenKind.SUBSCRIPTION], described.topics)
    services = _topics(ends[TokenKind.SERVICE], ends[TokenKind.CLIENT], {})
    return GraphView(nodes, topics, services, tuple(answers))


def _qos(token: Token) -> WireQoS:
    """Return the QoS of a token; the default if it has no valid one, so that the endpoint is shown all the same."""
    try:
        return from_text(token.qos)
    except MalformedMessage:
        return WireQoS()


class _Answers:
    """The processes' answers, by node, topic and endpoint."""

    def __init__(self, answers: Sequence[Mapping[str, Any]]) -> None:
        self.nodes: dict[str, Mapping[str, Any]] = {}
        self.topics: dict[str, Mapping[str, Any]] = {}
        self._ends: dict[tuple[TokenKind, str, str], list[Mapping[str, Any]]] = {}
        for answer in answers:
            process = {"process": answer["process"], "pid": answer["pid"]}
            self.nodes |= {node["name"]: node | process for node in answer["nodes"]}
            for topic in answer["topics"]:
                self.topics.setdefault(topic["name"], topic)
                for kind, word in ((TokenKind.PUBLISHER, "publishers"), (TokenKind.SUBSCRIPTION, "subscriptions")):
                    for end in topic[word]:
                        self._ends.setdefault((kind, end["node"], topic["name"]), []).append(end)

    def take(self, token: Token) -> Mapping[str, Any]:
        """Take the details of an endpoint: of a node's two on one topic, the second call gets those of the second."""
        found = self._ends.get((token.kind, token.node_name, token.topic))
        return found.pop(0) if found else {}


def _topics(
    senders: Sequence[EndView], receivers: Sequence[EndView], details: Mapping[str, Mapping[str, Any]]
) -> dict[str, TopicView]:
    """Return the topics, or the services, whose servers are the senders and whose clients the receivers."""
    names = sorted({end.token.topic for end in (*senders, *receivers)} | set(details))
    found: dict[str, TopicView] = {}
    for name in names:
        publishers = tuple(end for end in senders if end.token.topic == name)
        subscriptions = tuple(end for end in receivers if end.token.topic == name)
        types = {end.token.type: None for end in (*publishers, *subscriptions)} or {str(details[name]["type"]): None}
        found[name] = TopicView(name, tuple(types), publishers, subscriptions, details.get(name, {}))
    return found


def _node(name: str, ends: Mapping[TokenKind, Sequence[EndView]], details: Mapping[str, Any]) -> NodeView:
    kinds = TokenKind.PUBLISHER, TokenKind.SUBSCRIPTION, TokenKind.SERVICE, TokenKind.CLIENT
    publishers, subscriptions, servers, clients = (
        tuple(end for end in ends[kind] if end.node == name) for kind in kinds
    )
    return NodeView(name, publishers, subscriptions, servers, clients, details)


def _named(name: str, known: Mapping[str, Any], what: str) -> Any:
    full = absolute_name(name)
    if full not in known:
        shown = [each for each in known if not is_hidden(each)]
        raise NoSuchTarget(f"there is no {what} {printable(full)}; {did_you_mean(full, shown)}")
    return known[full]
