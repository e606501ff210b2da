"""Inputs: publishes recorded messages again, for the replayed nodes that receive them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Any

from busflow.actions.names import FEEDBACK
from busflow.bus.qos import Durability, Liveliness, QoS, Reliability
from busflow.errors import WouldBlock
from busflow.recording.bag.offered_qos import offered

if TYPE_CHECKING:
    from busflow.bus.publisher import Publisher
    from busflow.bus.subscription import Subscription
    from busflow.recording.bag.channel import Channel, Entry
    from busflow.recording.replay.goals import SentGoals
    from busflow.runner.graph import Graph


class Inputs:
    """Publishers on the topics that a graph's nodes receive and that none of these nodes publishes."""

    def __init__(
        self, graph: Graph, published: Collection[str], shares: Mapping[tuple[str, str], int], goals: SentGoals
    ) -> None:
        """Start without publishers.

        Args:
            graph: The nodes.
            published: The topics that the nodes publish themselves.
            shares: By node and topic, the number of messages that the node gets; without an entry it gets all.
            goals: The goals that the nodes send, whose feedback is recorded.
        """
        self._graph, self._published, self._shares, self._goals = graph, published, shares, goals
        self._publishers: dict[str, Publisher[Any]] = {}
        self.refused: dict[str, int] = {}
        """By topic, the number of messages for which a blocking queue had no room."""

    def feed(self, channel: Channel) -> Callable[[Entry], None] | None:
        """Return a function that publishes a channel's messages; None if no node needs them.

        The function raises BagError if the channel's type is not that of the subscription.
        """
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
        is_feedback, as_now = channel.topic.endswith(FEEDBACK), self._goals.as_now

        def publish(entry: Entry) -> None:
            if all_limited and all(each.published >= share for each, share in limited):
                return
            try:
                publisher.publish(channel.decode(as_now(entry.payload) if is_feedback else entry.payload, cls))
            except WouldBlock:
                self.refused[channel.topic] = self.refused.get(channel.topic, 0) + 1

        return publish

    @property
    def topics(self) -> frozenset[str]:
        """The topics that the nodes receive and none of them publishes."""
        return frozenset(self._received())

    def not_in(self, recorded: Collection[str]) -> Iterator[tuple[str, str]]:
        """Yield the topics that the nodes receive and that were not recorded, each with one of these nodes."""
        for topic, subscriptions in sorted(self._received().items()):
            if topic not in recorded:
                yield topic, subscriptions[0].endpoint.node

    def _received(self) -> dict[str, list[Subscription[Any]]]:
        found: dict[str, list[Subscription[Any]]] = {}
        for supervisor in self._graph.supervisors:
            for each in supervisor.runtime.endpoints.subscriptions:
                if each.topic not in self._published:
                    found.setdefault(each.topic, []).append(each)
        return found


def offer_for(received: list[Subscription[Any]], recorded: QoS | None) -> QoS:
    """Return a QoS that suits every subscription; depth and lifespan are those of the recorded publisher."""
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
