"""A graph's nodes and topics, as text, Mermaid, Graphviz or data."""

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


class Drawing:
    """Who publishes what to whom."""

    def __init__(self, name: str, members: Sequence[Member]) -> None:
        """A drawing of the members of a plan."""
        self.name = name
        self._nodes = {member.runtime.full_name: member.plugin for member in members}
        self._topics: dict[str, _Topic] = {}
        for member in members:
            for end in member.publishers:
                self._topic(end.topic, type_name(end.type)).publishers.append(end.node)
            for end in member.subscriptions:
                self._topic(end.topic, type_name(end.type)).receivers.append(end.node)

    def _topic(self, name: str, type_: str) -> _Topic:
        return self._topics.setdefault(name, _Topic(type_))

    def text(self) -> Iterator[str]:
        """Lines for people: under each node what it publishes, and to whom; last what nobody publishes."""
        for node, plugin in self._nodes.items():
            yield f"{node}  ({printable(plugin)})"
            yield from self._text_of(node)
        if any(not topic.publishers for topic in self._topics.values()):
            yield "nobody"
            yield from self._text_of(None)

    def _text_of(self, node: str | None) -> Iterator[str]:
        rows = [
            (name, topic.type, "→", ", ".join(topic.receivers) or "nobody")
            for name, topic in self._topics.items()
            if (node in topic.publishers if node else not topic.publishers)
        ]
        yield from (f"  {line}" for line in columns(rows))

    def mermaid(self) -> Iterator[str]:
        """A Mermaid flowchart: nodes are boxes, topics are round."""
        yield "flowchart LR"
        for index, node in enumerate(self._nodes):
            yield f'  n{index}["{node}"]'
        for index, (name, topic) in enumerate(self._topics.items()):
            yield f'  t{index}(["{name}<br/>{topic.type}"])'
        yield from (f"  {start} --> {end}" for start, end in self._arrows())

    def dot(self) -> Iterator[str]:
        """A Graphviz digraph: nodes are boxes, topics are ellipses."""
        yield "digraph {\n  rankdir=LR"
        for index, node in enumerate(self._nodes):
            yield f'  n{index} [shape=box, label="{node}"]'
        for index, (name, topic) in enumerate(self._topics.items()):
            yield f'  t{index} [shape=ellipse, label="{name}\\n{topic.type}"]'
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
        }

    def _arrows(self) -> Iterator[tuple[str, str]]:
        """From node to topic and from topic to node, by the short names that both drawings use."""
        number = {node: f"n{index}" for index, node in enumerate(self._nodes)}
        for index, topic in enumerate(self._topics.values()):
            yield from ((number[node], f"t{index}") for node in dict.fromkeys(topic.publishers))
            yield from ((f"t{index}", number[node]) for node in dict.fromkeys(topic.receivers))
