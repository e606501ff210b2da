"""A graph's nodes, topics and services, as text, Mermaid, Graphviz or data."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from busflow.cli.output import columns
from busflow.message import type_name
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.launchfile.preflight import Member


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

    def __init__(self, name: str, members: Sequence[Member]) -> None:
        """A drawing of the members of a plan."""
        self.name = name
        self._nodes = {member.runtime.full_name: member.plugin for member in members}
        self._topics: dict[str, _Topic] = {}
        self._services: dict[str, _Service] = {}
        for member in members:
            for end in member.publishers:
                self._topic(end.topic, type_name(end.type)).publishers.append(end.node)
            for end in member.subscriptions:
                self._topic(end.topic, type_name(end.type)).receivers.append(end.node)
            for served in member.servers:
                self._service(served.service, type_name(served.type)).servers.append(served.node)
            for asked in member.clients:
                self._service(asked.service, type_name(asked.type)).clients.append(asked.node)

    def _topic(self, name: str, type_: str) -> _Topic:
        return self._topics.setdefault(name, _Topic(type_))

    def _service(self, name: str, type_: str) -> _Service:
        return self._services.setdefault(name, _Service(type_))

    def text(self) -> Iterator[str]:
        """Lines for people: under each node what it publishes to whom and answers to whom; last what nobody does."""
        for node, plugin in self._nodes.items():
            yield f"{node}  ({printable(plugin)})"
            yield from self._text_of(node)
        left = list(self._text_of(None))
        yield from ("nobody", *left) if left else ()

    def _text_of(self, node: str | None) -> Iterator[str]:
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
        yield from (f"  {line}" for line in columns(rows))

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
