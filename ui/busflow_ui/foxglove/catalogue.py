"""Catalogue: the topics and services of a run that viewers are offered, each under a number, and their changes.

Looking asks the run and waits; it is a step of its own, so that it can be taken in another thread.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, TypeAlias

from busflow.commands import GraphView, Selection, TopicView, actions_of, full_topic_name_fault, known_type
from busflow.errors import BusflowError, InspectionUnavailable, NoSuchTarget
from busflow.text import did_you_mean, printable

if TYPE_CHECKING:
    from busflow.commands import ForeignType, Peer, ServiceKind

CLOCK = "/clock"
CLOCK_TYPE = "rosgraph_msgs/msg/Clock"
Kind: TypeAlias = tuple[str, str | None]
"""Type by its name and its hash, if that is known."""


@dataclass(frozen=True, slots=True)
class OfferedTopic:
    """Topic that is offered to viewers."""

    id: int
    topic: TopicView
    type: ForeignType

    def announcement(self) -> dict[str, Any]:
        """Return the announcement of this entry, in the protocol's words."""
        return {"id": self.id, "topic": self.topic.name, **written_form(self.type)}


@dataclass(frozen=True, slots=True)
class OfferedService:
    """Service that is offered to viewers."""

    id: int
    kind: ServiceKind

    @property
    def encoding(self) -> str:
        """Encoding of the service's requests and answers."""
        return self.kind.request.encoding

    def announcement(self) -> dict[str, Any]:
        """Return the announcement of this entry, in the protocol's words."""
        parts = {"request": self.kind.request, "response": self.kind.response}
        schemas = {word: written_form(part) for word, part in parts.items()}
        return {"id": self.id, "name": self.kind.name, "type": self.kind.type, **schemas}


@dataclass(frozen=True, slots=True)
class Seen:
    """State of a run at one moment, with the types that are needed to read its messages."""

    graph: GraphView
    types: Mapping[Kind, ForeignType]
    services: Mapping[str, ServiceKind]


@dataclass(frozen=True, slots=True)
class Change:
    """Entries that are new in a catalogue, and numbers of those that are gone."""

    channels: tuple[OfferedTopic, ...] = ()
    gone_channels: tuple[int, ...] = ()
    services: tuple[OfferedService, ...] = ()
    gone_services: tuple[int, ...] = ()


class Catalogue:
    """Channels and services that are offered now."""

    def __init__(self, peer: Peer, wanted: Selection, print_message: Callable[[str], None]) -> None:
        self.channels: dict[int, OfferedTopic] = {}
        self.services: dict[int, OfferedService] = {}
        self._peer, self._wanted, self._print = peer, wanted, print_message
        self._ids = 0
        self._types: dict[Kind, ForeignType] = {}
        self._kinds: dict[tuple[str, str], ServiceKind] = {}
        self._printed: set[str] = set()

    def require_matches(self, graph: GraphView) -> None:
        """Refuse patterns that no topic of the run has.

        Raises:
            NoSuchTarget: one of them matches none; the message names the nearest topic.
        """
        names = [name for name in graph.topics if self._wanted.includes(name)]
        for pattern in self._wanted.unmatched:
            known = [name for name in graph.topics if name not in names and not graph.topics[name].hidden]
            advice = did_you_mean(f"/{pattern.strip('/')}", known)
            raise NoSuchTarget(f"no topic matches {printable(pattern)!r}; {advice}")

    def look(self) -> Seen:
        """Ask the run for its topics, services and types. Blocks until the run answers; for one thread at a time."""
        graph = self._peer.graph()
        for topic in self._topics(graph):
            for kind in topic.kinds:
                if kind not in self._types:
                    self._learn(topic.name, kind)
        unknown = [each.name for each in _answered(graph) if (each.name, each.types[0]) not in self._kinds]
        if unknown:
            try:
                self._kinds |= {(kind.name, kind.type): kind for kind in self._peer.services(unknown).values()}
            except InspectionUnavailable:
                raise
            except BusflowError as error:
                self._print_once(f"warning: services are not offered: {error}")
        services = {
            each.name: self._kinds[each.name, each.types[0]]
            for each in _answered(graph)
            if (each.name, each.types[0]) in self._kinds
        }
        return Seen(graph, dict(self._types), services)

    def update(self, seen: Seen) -> Change:
        """Offer the topics and services of a seen state; return the changes."""
        topics = {
            (topic.name, seen.types[kind]): topic
            for topic in self._topics(seen.graph)
            for kind in topic.kinds
            if kind in seen.types
        }
        gone = [id_ for id_, each in self.channels.items() if _key(each) not in topics]
        for id_ in gone:
            del self.channels[id_]
        offered = {_key(each): id_ for id_, each in self.channels.items()}
        new: list[OfferedTopic] = []
        for key, topic in topics.items():
            if key in offered:  # its publishers decide how it is subscribed to
                self.channels[offered[key]] = replace(self.channels[offered[key]], topic=topic)
            else:
                new.append(OfferedTopic(self._next(), topic, key[1]))
        self.channels |= {each.id: each for each in new}
        services, gone_services = self._update_services(seen)
        return Change(tuple(new), tuple(gone), services, gone_services)

    def clock(self) -> OfferedTopic | None:
        """Return the channel of `/clock`, if it is published."""
        clocks = (each for each in self.channels.values() if (each.topic.name, each.type.name) == (CLOCK, CLOCK_TYPE))
        return next((each for each in clocks if each.topic.publishers), None)

    def _update_services(self, seen: Seen) -> tuple[tuple[OfferedService, ...], tuple[int, ...]]:
        gone = tuple(id_ for id_, each in self.services.items() if seen.services.get(each.kind.name) is not each.kind)
        for id_ in gone:
            del self.services[id_]
        offered = {each.kind.name for each in self.services.values()}
        new = tuple(OfferedService(self._next(), kind) for name, kind in seen.services.items() if name not in offered)
        self.services |= {each.id: each for each in new}
        return new, gone

    def _topics(self, graph: GraphView) -> Iterator[TopicView]:
        """Return the wanted topics, and the feedback and states of the wanted actions, though their names are hidden.

        A name that breaks ROS's grammar has no key to listen to, and is left out.
        """
        actions = (each for each in actions_of(graph).values() if self._wanted.includes(each.name))
        of_actions = {name for each in actions for name in each.topics}
        wanted = (each for each in graph.topics.values() if each.name in of_actions or self._wanted.includes(each.name))
        return (topic for topic in wanted if full_topic_name_fault(topic.name) is None)

    def _learn(self, topic: str, kind: Kind) -> None:
        """Look a type up; a topic of an unknown type cannot be shown, which is reported once."""
        try:
            self._types[kind] = known_type(self._peer, *kind)
        except InspectionUnavailable:
            raise
        except BusflowError as error:
            self._print_once(f"warning: {topic} is not offered: {error}")

    def _print_once(self, text: str) -> None:
        if text not in self._printed and len(self._printed) < 100:
            self._printed.add(text)
            self._print(text)

    def _next(self) -> int:
        self._ids += 1
        return self._ids


def _key(channel: OfferedTopic) -> tuple[str, ForeignType]:
    return channel.topic.name, channel.type


def _answered(graph: GraphView) -> list[TopicView]:
    """Return the services that have a server and are not hidden."""
    return [each for each in graph.services.values() if each.publishers and not each.hidden]


def written_form(type_: ForeignType) -> dict[str, str]:
    """Return a type's name, the encoding of its messages and its definition, in the protocol's words."""
    schema = {"schemaEncoding": type_.definition_encoding, "schema": type_.definition}
    return {"schemaName": type_.name, "encoding": type_.encoding, **schema}
