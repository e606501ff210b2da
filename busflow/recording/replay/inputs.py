"""The inputs of a replay: recorded messages that are published anew, for the nodes that receive them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from busflow.bus.qos import Durability, Liveliness, QoS, Reliability
from busflow.errors import WouldBlock
from busflow.recording.bag.offered_qos import offered

if TYPE_CHECKING:
    from busflow.bus.publisher import Publisher
    from busflow.bus.subscription import Subscription
    from busflow.recording.bag.channel import Channel, Entry
    from busflow.runner.graph import Graph


class Inputs:
    """Publishes on the topics that the nodes of a graph receive, and that none of them publishes."""

    def __init__(self, graph: Graph, published: Collection[str], shares: Mapping[tuple[str, str], int]) -> None:
        """Inputs for a graph whose nodes publish these topics themselves.

        By node and topic `shares` says how many messages a node gets, where that is not all of them.
        """
        self._graph, self._published, self._shares = graph, published, shares
        self._publishers: dict[str, Publisher[Any]] = {}
        self.refused: dict[str, int] = {}
        """By topic, the number of messages that found no room in a blocking queue."""

    def feed(self, channel: Channel) -> Callable[[Entry], None] | None:
        """A publisher for messages of a channel; None if it is not needed. Raises BagError for another type."""
        received = self._received().get(channel.topic)
        if not received:
            return None
        cls = received[0].type
        publisher = self._publishers.get(channel.topic)
        if publisher is None:
            qos = offer_for(received, offered(channel.qos))
            publisher = self._publishers[channel.topic] = self._graph.advertise(cls, channel.topic, qos=qos)

        known = [(each, self._shares.get((each.endpoint.node, each.topic))) for each in received]
        limited = [(each, share) for each, share in known if share is not None]
        all_limited = len(limited) == len(known)

        def publish(entry: Entry) -> None:
            if all_limited and all(each.published >= share for each, share in limited):
                return
            try:
                publisher.publish(channel.decode(entry.payload, cls))
            except WouldBlock:
                self.refused[channel.topic] = self.refused.get(channel.topic, 0) + 1

        return publish

    @property
    def topics(self) -> frozenset[str]:
        """The topics that the nodes receive and none of them publishes."""
        return frozenset(self._received())

    def not_in(self, recorded: Collection[str]) -> Iterator[tuple[str, str]]:
        """The topics that the nodes receive and that were not recorded, each with a node."""
        for topic, subscriptions in sorted(self._received().items()):
            if topic not in recorded:
                yield topic, subscriptions[0].endpoint.node

    def _received(self) -> dict[str, list[Subscription[Any]]]:
        found: dict[str, list[Subscription[Any]]] = {}
        for unit in self._graph.units:
            for each in unit.runtime.endpoints.subscriptions:
                if each.topic not in self._published:
                    found.setdefault(each.topic, []).append(each)
        return found


def offer_for(received: list[Subscription[Any]], recorded: QoS | None) -> QoS:
    """A profile of which every subscription can receive, that keeps and forgets messages as the recorded one did."""
    wanted = [each.endpoint.qos for each in received]
    recorded = recorded or QoS()
    latched = any(each.latched for each in (*wanted, recorded))
    manual = any(each.liveliness is Liveliness.MANUAL_BY_TOPIC for each in wanted)
    return QoS(
        depth=recorded.depth,
        reliability=Reliability.RELIABLE,
        durability=Durability.TRANSIENT_LOCAL if latched else Durability.VOLATILE,
        liveliness=Liveliness.MANUAL_BY_TOPIC if manual else Liveliness.AUTOMATIC,
        deadline_s=min((each.deadline_s for each in wanted if each.deadline_s is not None), default=None),
        lease_s=min((each.lease_s for each in wanted if each.lease_s is not None), default=None),
        lifespan_s=recorded.lifespan_s,
    )
