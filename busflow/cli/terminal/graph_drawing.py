"""Drawing: a graph's nodes, topics and services, as text, Mermaid, Graphviz or data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Self

from busflow.cli.terminal.table import Column, bare, table_lines
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.runner.planning.planned_node import PlannedNode
    from busflow.wire.client.graph_view import EndView, GraphView, NodeView

_EVERY_NODES_TOPICS = ("/rosout", "/parameter_events")
_EVERY_NODES_SERVICES = "rcl_interfaces/srv/"


@dataclass(slots=True)
class _Link:
    """A topic or service with the nodes at its endpoints."""

    type: str
    sources: list[str] = field(default_factory=list[str])
    """The nodes that publish the topic, or call the service."""
    sinks: list[str] = field(default_factory=list[str])
    """The nodes that subscribe to the topic, or serve the service."""


class Drawing:
    """A drawing of a graph: nodes, and the topics and services between them."""

    def __init__(self, name: str) -> None:
        """Create an empty drawing."""
        self.name = name
        self._nodes: dict[str, str] = {}
        self._topics: dict[str, _Link] = {}
        self._services: dict[str, _Link] = {}

    @classmethod
    def of_plan(cls, name: str, nodes: Sequence[PlannedNode]) -> Self:
        """Return a drawing of the nodes of a plan."""
        from busflow.interfaces.message import type_name

        drawn = cls(name)
        drawn._nodes = {planned.runtime.full_name: planned.plugin for planned in nodes}
        for planned in nodes:
            for end in planned.publishers:
                _link(drawn._topics, end.topic, type_name(end.type)).sources.append(end.node)
            for end in planned.subscriptions:
                _link(drawn._topics, end.topic, type_name(end.type)).sinks.append(end.node)
            for served in planned.servers:
                _link(drawn._services, served.service, type_name(served.type)).sinks.append(served.node)
            for asked in planned.clients:
                _link(drawn._services, asked.service, type_name(asked.type)).sources.append(asked.node)
        return drawn

    @classmethod
    def of_view(cls, name: str, graph: GraphView, *, all_: bool) -> Self:
        """Return a drawing of a running graph; unless `all_`, leave out hidden parts and what every node has."""
        drawn = cls(name)
        drawn._nodes = {_safe(node.name): _kind(node) for node in graph.nodes.values() if all_ or not node.hidden}
        for topic in graph.topics.values():
            if all_ or not (topic.hidden or topic.name in _EVERY_NODES_TOPICS):
                link = _link(drawn._topics, _safe(topic.name), _safe(topic.type))
                link.sources += drawn._drawn_nodes(topic.publishers)
                link.sinks += drawn._drawn_nodes(topic.subscriptions)
        for service in graph.services.values():
            if all_ or not (service.hidden or service.type.startswith(_EVERY_NODES_SERVICES)):
                link = _link(drawn._services, _safe(service.name), _safe(service.type))
                link.sources += drawn._drawn_nodes(service.subscriptions)
                link.sinks += drawn._drawn_nodes(service.publishers)
        return drawn

    def _drawn_nodes(self, ends: Sequence[EndView]) -> list[str]:
        return [node for end in ends if (node := _safe(end.node)) in self._nodes]

    def text(self, width: int | None = None) -> Iterator[str]:
        """Yield lines of at most `width`: each node with its topics and their subscribers, its services and clients."""
        for node, plugin in self._nodes.items():
            yield from table_lines([(node, f"({printable(plugin)})")], width=width)
            yield from self._text_of(node, width)
        left = list(self._text_of(None, width))
        yield from ("no node", *left) if left else ()

    def _text_of(self, node: str | None, width: int | None) -> Iterator[str]:
        rows = [
            (name, topic.type, "→", ", ".join(topic.sinks) or "no node")
            for name, topic in self._topics.items()
            if (node in topic.sources if node else not topic.sources)
        ]
        rows += [
            (name, service.type, "←", ", ".join(service.sources) or "no node")
            for name, service in self._services.items()
            if (node in service.sinks if node else not service.sinks)
        ]
        receivers = Column(folds=True)
        yield from table_lines(rows, Column(), Column(short=bare), Column(), receivers, indent="  ", width=width)

    def mermaid(self) -> Iterator[str]:
        """Yield a Mermaid flowchart: nodes are boxes, topics are round, services are hexagons."""
        yield "flowchart LR"
        for index, node in enumerate(self._nodes):
            yield f'  n{index}["{node}"]'
        for index, (name, topic) in enumerate(self._topics.items()):
            yield f'  t{index}(["{name}<br/>{topic.type}"])'
        for index, (name, service) in enumerate(self._services.items()):
            yield f'  s{index}{{{{"{name}<br/>{service.type}"}}}}'
        yield from (f"  {start} --> {end}" for start, end in self._arrows())

    def dot(self) -> Iterator[str]:
        """Yield a Graphviz digraph: nodes are boxes, topics are ellipses, services are hexagons."""
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
        """Return the graph as `--format json` prints it."""
        return {
            "name": self.name,
            "nodes": [{"name": node, "plugin": plugin} for node, plugin in self._nodes.items()],
            "topics": [
                {"name": name, "type": topic.type, "publishers": topic.sources, "subscriptions": topic.sinks}
                for name, topic in self._topics.items()
            ],
            "services": [
                {"name": name, "type": service.type, "servers": service.sinks, "clients": service.sources}
                for name, service in self._services.items()
            ],
        }

    def _arrows(self) -> Iterator[tuple[str, str]]:
        """Yield the arrows from sources over topics and services to sinks, by the short names in both formats."""
        number = {node: f"n{index}" for index, node in enumerate(self._nodes)}
        for letter, links in (("t", self._topics), ("s", self._services)):
            for index, link in enumerate(links.values()):
                yield from ((number[node], f"{letter}{index}") for node in dict.fromkeys(link.sources))
                yield from ((f"{letter}{index}", number[node]) for node in dict.fromkeys(link.sinks))


def _link(links: dict[str, _Link], name: str, type_: str) -> _Link:
    return links.setdefault(name, _Link(type_))


def _safe(name: str) -> str:
    """Return a name from another process, made safe for a terminal and for a quoted label."""
    return printable(name).replace('"', "'")


def _kind(node: NodeView) -> str:
    """Return a node's plugin, marked if the node has failed."""
    plugin = str(node.details.get("plugin", "no plugin"))
    return f"{plugin}, failed" if node.details.get("state") == "failed" else plugin
