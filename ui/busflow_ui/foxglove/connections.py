"""Connections: the nodes that publish, receive and answer each name, as a viewer draws them, and changes. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

if TYPE_CHECKING:
    from busflow.commands import EndView, GraphView

NodesByName: TypeAlias = Mapping[str, tuple[str, ...]]
"""Nodes by the name of the topic or service."""
_OF_PARAMETERS = "rcl_interfaces/srv/"
"""Types of the six services for parameters that each node has; drawn, they would hide all other lines."""
_PARAMETER_EVENTS = "/parameter_events"
"""Topic on which each node with parameters publishes; it is left out for the same reason."""


@dataclass(frozen=True, slots=True)
class Connections:
    """Nodes at the endpoints of each topic and service; hidden ones and those for parameters are left out."""

    published: NodesByName = field(default_factory=dict[str, tuple[str, ...]])
    subscribed: NodesByName = field(default_factory=dict[str, tuple[str, ...]])
    services: NodesByName = field(default_factory=dict[str, tuple[str, ...]])

    @classmethod
    def of(cls, graph: GraphView) -> Connections:
        """Return the connections of a run."""
        hidden = {node.name for node in graph.nodes.values() if node.hidden}

        def nodes(ends: Iterable[EndView]) -> tuple[str, ...]:
            return tuple(sorted({end.node for end in ends} - hidden))

        shown = [topic for topic in graph.topics.values() if not topic.hidden]
        return cls(
            {
                topic.name: found
                for topic in shown
                if topic.name != _PARAMETER_EVENTS and (found := nodes(topic.publishers))
            },
            {topic.name: found for topic in shown if (found := nodes(topic.subscriptions))},
            {
                each.name: found
                for each in graph.services.values()
                if not each.type.startswith(_OF_PARAMETERS) and (found := nodes(each.publishers))
            },
        )

    def since(self, former: Connections) -> Mapping[str, Any]:
        """Return the update for a viewer that knows the former entries, in the protocol's words."""
        topics = self.published.keys() | self.subscribed.keys()
        former_topics = former.published.keys() | former.subscribed.keys()
        return {
            "publishedTopics": _changed(self.published, former.published, "publisherIds", topics),
            "subscribedTopics": _changed(self.subscribed, former.subscribed, "subscriberIds", topics),
            "advertisedServices": _changed(self.services, former.services, "providerIds", self.services.keys()),
            "removedTopics": sorted(former_topics - topics),
            "removedServices": sorted(former.services.keys() - self.services.keys()),
        }


def _changed(now: NodesByName, former: NodesByName, word: str, names: Iterable[str]) -> list[dict[str, Any]]:
    """Return each changed entry; a topic or service whose nodes have all gone has an empty list."""
    return [
        {"name": name, word: list(now.get(name, ()))}
        for name in sorted(names)
        if now.get(name, ()) != former.get(name, ())
    ]
