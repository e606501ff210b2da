"""A graph's nodes, topics and services, as text, Mermaid, Graphviz or data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

from busflow.cli.terminal.table import Column, bare, table_lines
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.launchfile.check.member import Member
    from busflow.wire.client.graph_view import EndView, GraphView, NodeView

_EVERY_NODES_TOPICS = ("/rosout", "/parameter_events")
_EVERY_NODES_SERVICES = "rcl_interfaces/srv/"


@dataclass(slots=True)
class _Topic:
    """A topic with the nodes on its two ends."""

    type: str
    publishers: list[str] = field(default_factory=list[str])
    receivers: list[str] = field(default_factory=list[str])


@dataclass(slots=True)
class _Service:
    """A service with the nodes on its two ends."""

    type: str
    servers: list[str] = field(default_factory=list[str])
    clients: list[str] = field(default_factory=list[str])


class Drawing:
    """Who publishes what to whom, and who asks whom."""

    def __init__(self, name: str) -> None:
        """A drawing of nothing yet."""
        self.name = name
        self._nodes: dict[str, str] = {}
        self._topics: dict[str, _Topic] = {}
        self._services: dict[str, _Service] = {}

    @classmethod
    def of_plan(cls, name: str, members: Sequence[Member]) -> Self:
        """A drawing of the members of a plan."""
        from busflow.interfaces.message import type_name

        drawn = cls(name)
        drawn._nodes = {member.runtime.full_name: member.plugin for member in members}
        for member in members:
            for end in member.publishers:
                drawn._topic(end.topic, type_name(end.type)).publishers.append(end.node)
            for end in member.subscriptions:
                drawn._topic(end.topic, type_name(end.type)).receivers.append(end.node)
            for served in member.servers:
                drawn._service(served.service, type_name(served.type)).servers.append(served.node)
            for asked in member.clients:
                drawn._service(asked.service, type_name(asked.type)).clients.append(asked.node)
        return drawn

    @classmethod
    def of_view(cls, name: str, graph: GraphView, *, all_: bool) -> Self:
        """A drawing of a graph that runs; without what is hidden, or every node has, unless all is wanted."""
        drawn = cls(name)
        drawn._nodes = {_safe(node.name): _kind(node) for node in graph.nodes.values() if all_ or not node.hidden}
        for topic in graph.topics.values():
            if all_ or not (topic.hidden or topic.name in _EVERY_NODES_TOPICS):
                shown = drawn._topic(_safe(topic.name), _safe(topic.type))
                shown.publishers += drawn._drawn_nodes(topic.publishers)
                shown.receivers += drawn._drawn_nodes(topic.subscriptions)
        for service in graph.services.values():
            if all_ or not (service.hidden or service.type.startswith(_EVERY_NODES_SERVICES)):
                both = drawn._service(_safe(service.name), _safe(service.type))
                both.servers += drawn._drawn_nodes(service.publishers)
                both.clients += drawn._drawn_nodes(service.subscriptions)
        return drawn

    def _drawn_nodes(self, ends: Sequence[EndView]) -> list[str]:
        return [node for end in ends if (node := _safe(end.node)) in self._nodes]

    def _topic(self, name: str, type_: str) -> _Topic:
        return self._topics.setdefault(name, _Topic(type_))

    def _service(self, name: str, type_: str) -> _Service:
        return self._services.setdefault(name, _Service(type_))

    def text(self, width: int | None = None) -> Iterator[str]:
        """Lines for people, no longer than that: under each node what it publishes to whom and answers to whom."""
        for node, plugin in self._nodes.items():
            yield from table_lines([(node, f"({printable(plugin)})")], width=width)
            yield from self._text_of(node, width)
        left = list(self._text_of(None, width))
        yield from ("nobody", *left) if left else ()

    def _text_of(self, node: str | None, width: int | None) -> Iterator[str]:
        rows = [
            (name, topic.type, "→", ", ".join(topic.receivers) or "nobody")
            for name, topic in self._topics.items()
            if (node in topic.publishers if node else not topic.publishers)
        ]
        rows += [
            (name, service.type, "←", ", ".join(service.clients) or "nobody")
            for name, service in self._services.items()
            if (node in service.servers if node else not service.servers)
        ]
        receivers = Column(folds=True)
        yield from table_lines(rows, Column(), Column(short=bare), Column(), receivers, indent="  ", width=width)

    def mermaid(self) -> Iterator[str]:
        """A Mermaid flowchart: nodes are boxes, topics are round, services have six corners."""
        yield "flowchart LR"
        for index, node in enumerate(self._nodes):
            yield f'  n{index}["{node}"]'
        for index, (name, topic) in enumerate(self._topics.items()):
            yield f'  t{index}(["{name}<br/>{topic.type}"])'
        for index, (name, service) in enumerate(self._services.items()):
            yield f'  s{index}{{{{"{name}<br/>{service.type}"}}}}'
        yield from (f"  {start} --> {end}" for start, end in self._arrows())

    def dot(self) -> Iterator[str]:
        """A Graphviz digraph: nodes are boxes, topics are ellipses, services have six corners."""
        yield "digraph {\n  rankdir=LR"
        for index, node in enumerate(self._nodes):
            yield f'  n{index} [shape=box, label="{node}"]'
        for index, (name, topic) in enumerate(self._topics.items()):
            yield f'  t{index} [shape=ellipse, label="{name}\\n{topic.type}"]'
        for index, (name, service) in enumerate(self._services.items()):
            yield f'  s{index} [shape=hexagon, label="{name}\\n{service.type}"]'
        yield from (f"  {start} -> {end}" for start, end in self._arrows())
        yield "}"

    def data(self) -> dict[str, Any]:
        """The graph as `--format json` prints it."""
        return {
            "name": self.name,
            "nodes": [{"name": node, "plugin": plugin} for node, plugin in self._nodes.items()],
            "topics": [
                {"name": name, "type": topic.type, "publishers": topic.publishers, "subscriptions": topic.receivers}
                for name, topic in self._topics.items()
            ],
            "services": [
                {"name": name, "type": service.type, "servers": service.servers, "clients": service.clients}
                for name, service in self._services.items()
            ],
        }

    def _arrows(self) -> Iterator[tuple[str, str]]:
        """From who publishes or asks, over the topic or service, by the short names that both drawings use."""
        number = {node: f"n{index}" for index, node in enumerate(self._nodes)}
        for index, topic in enumerate(self._topics.values()):
            yield from ((number[node], f"t{index}") for node in dict.fromkeys(topic.publishers))
            yield from ((f"t{index}", number[node]) for node in dict.fromkeys(topic.receivers))
        for index, service in enumerate(self._services.values()):
            yield from ((number[node], f"s{index}") for node in dict.fromkeys(service.clients))
            yield from ((f"s{index}", number[node]) for node in dict.fromkeys(service.servers))


def _safe(name: str) -> str:
    """A name that another process states, fit for a terminal and for a label in quotes."""
    return printable(name).replace('"', "'")


def _kind(node: NodeView) -> str:
    """What a node is, and that it has failed."""
    plugin = str(node.details.get("plugin", "no plugin"))
    return f"{plugin}, failed" if node.details.get("state") == "failed" else plugin
