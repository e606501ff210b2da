"""Late joiners: transient_local subscriptions that want more kept messages than the inlet has asked for.

When the inlet starts, it asks each remote publisher for as many kept messages as its deepest subscription wants. For a
subscription that comes later and wants more, it asks again. Until the answers are here, new messages wait in a gate in
front of the late joiner's queue. So no subscription gets a message twice, or before an earlier one. Other subscriptions
do not wait.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, cast

import zenoh

from busflow import timeouts
from busflow.bus.publisher import Publisher
from busflow.clock import NS_PER_S
from busflow.errors import MalformedMessage
from busflow.wire.mirror.connection import decoded
from busflow.wire.zenoh.keys import Attachment

if TYPE_CHECKING:
    from busflow.bus.subscription import Subscription
    from busflow.bus.topic import Receiver, Topic
    from busflow.clock import Clock
    from busflow.wire.mirror.arrivals import Arrivals
    from busflow.wire.mirror.connection import Connection

_MOST_MESSAGES = 10_000
"""Limit of the kept messages accepted from one query, and of the new messages that wait in a gate.

Further kept messages are ignored; of too many new messages the oldest enters the queue before the kept ones.
"""


class LateJoiners:
    """The late joiners of one topic."""

    def __init__(
        self,
        topic: Topic[Any],
        key: str,
        publishers: Mapping[bytes, Publisher[Any]],
        connection: Connection,
        *,
        numbers: Arrivals,
        asked: int,
    ) -> None:
        """Start without late joiners.

        Args:
            topic: the topic that they receive.
            key: the Zenoh key of the topic's messages.
            publishers: the remote publishers that the inlet has admitted, by gid.
            connection: the session in which the publishers are asked.
            numbers: the record of the topic's messages, which counts the kept ones.
            asked: how many kept messages the inlet's own subscriber asks of each publisher.
        """
        self.delivering: tuple[bytes, int] | None = None
        """Publisher and number of the message that the topic delivers now; None if its publisher is local."""
        self.first: dict[bytes, int] = {}
        """By publisher, the number of its earliest message known here."""
        self._topic, self._key, self._publishers, self._connection = topic, key, publishers, connection
        self._numbers, self._asked = numbers, asked
        self._asked_so_far: dict[bytes, int] = {}
        """By publisher, how many kept messages were asked of it so far; without an entry it is `asked`."""
        self._gates: list[Gate] = []
        self._remembered: dict[bytes, dict[int, Any]] = {}
        """By publisher and number, the kept messages that arrived only because they were asked for here."""

    def note(self, gid: bytes, sequence: int) -> None:
        """Note the message that is about to be delivered; its publisher's liveliness token may arrive after it."""
        self.delivering = gid, sequence
        self.first.setdefault(gid, sequence)
        remembered = self._remembered.get(gid)
        if remembered and (item := remembered.pop(sequence, None)) is not None:
            self._publishers[gid].forget(item)

    def ask_publisher(self, gid: bytes, newcomers: Collection[Subscription[Any]] | None) -> None:
        """Ask a publisher for its kept messages, because it has just come and some subscriptions want more of them.

        The inlet's own subscriber asks a new publisher too, so only a subscription that wants more is served here. When
        a publisher comes back, its earlier messages are not published again: only the `newcomers`, the subscriptions
        that were made while it was away, lack them.
        """
        if newcomers is not None:
            self._asked_so_far[gid] = 0
        for subscription in self._topic.subscriptions if newcomers is None else newcomers:
            if self._lacks(subscription, gid):
                self._ask(Gate.of(cast("Subscription[Any]", subscription), self), [gid])

    def ask_again(self, gid: bytes) -> None:
        """Ask a publisher for its kept messages, because a later one arrives first; that one waits for the answer."""
        self._asked_so_far[gid] = 0
        self.ask_publisher(gid, None)

    def forget(self, gid: bytes) -> None:
        """Forget a publisher that has gone."""
        for book in (self.first, self._asked_so_far, self._remembered):
            book.pop(gid, None)

    def serve(self, subscription: Subscription[Any]) -> None:
        """Ask for the kept messages that a new subscription lacks; it has delivered no message yet."""
        lacking = [gid for gid in self._publishers if self._lacks(subscription, gid)]
        if lacking:
            gate = Gate.of(subscription, self)
            gate.hold_queue()
            self._ask(gate, lacking)

    def close(self) -> None:
        """Give every late joiner the messages that have arrived, and stop waiting for answers."""
        for gate in tuple(self._gates):
            self._finish(gate)

    def _lacks(self, subscription: Receiver, gid: bytes) -> bool:
        """Return whether a subscription wants more of a publisher's kept messages than are here or on their way."""
        publisher, qos = self._publishers[gid], subscription.endpoint.qos
        if not (qos.latched and publisher.endpoint.qos.latched):
            return False
        wanted = min(qos.depth, publisher.endpoint.qos.depth)
        return wanted > max(self._asked_so_far.get(gid, self._asked), len(publisher.history))

    def _ask(self, gate: Gate, publishers: Collection[bytes]) -> None:
        gate.questions += 1
        if gate not in self._gates:
            self._gates.append(gate)
        self._topic.rebuild()
        found: list[tuple[bytes, zenoh.ZBytes]] = []

        def take(reply: zenoh.Reply) -> None:
            if reply.ok is not None and reply.ok.attachment is not None and len(found) < _MOST_MESSAGES:
                found.append((reply.ok.attachment.to_bytes(), reply.ok.payload))

        def end() -> None:
            self._connection.on_loop(self._answered, gate, publishers, found)

        callback: Any = zenoh.handlers.Callback(take, drop=end, indirect=False)
        self._connection.session.get(
            # An advanced publisher of Zenoh, also one of ROS 2, answers with its kept messages at this key.
            f"{self._key}/@adv/**?_max={gate.target.endpoint.qos.depth}",
            callback,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=zenoh.ReplyKeyExpr.ANY,
            allowed_destination=zenoh.Locality.REMOTE,
            timeout=timeouts.current.kept_messages,
        )

    def _answered(self, gate: Gate, asked: Collection[bytes], found: Collection[tuple[bytes, zenoh.ZBytes]]) -> None:
        if gate not in self._gates:
            return  # the inlet has closed
        support = self._connection.supports(self._topic.type)
        for attachment, payload in found:
            try:
                sent = Attachment.decode(attachment)
                publisher = self._publishers.get(sent.gid)
                if publisher is not None and sent.gid in asked and not has_expired(publisher, sent, self._topic.clock):
                    item = publisher.as_kept(decoded(payload, support))
                    gate.kept.setdefault(sent.gid, {})[sent.sequence] = item
            except MalformedMessage:
                self._topic.losses["malformed"] += 1
        for gid in asked:
            self._asked_so_far[gid] = max(gate.target.endpoint.qos.depth, self._asked_so_far.get(gid, 0))
        gate.questions -= 1
        if not gate.questions:
            self._finish(gate)

    def _finish(self, gate: Gate) -> None:
        self._gates.remove(gate)
        for gid, items in gate.kept.items():
            if publisher := self._publishers.get(gid):  # else it has gone, and with it what it kept
                first = self.first.get(gid, max(items) + 1)
                earlier = {number: items[number] for number in sorted(items) if number < first}
                publisher.remember(tuple(earlier.values()))
                self._numbers.note_kept(gid, earlier)
                self._remembered.setdefault(gid, {}).update(earlier)
                self.first[gid] = min(first, *items)
        if gate.target in self._topic.subscriptions:
            gate.open()
            self._topic.rebuild()


class Gate:
    """Holds back a late joiner's new messages until the kept ones are in its queue; then only skips duplicates."""

    def __init__(self, target: Subscription[Any], late_joiners: LateJoiners) -> None:
        self.target = target
        self.questions = 0
        """Number of unanswered queries; the gate is shut until it is 0."""
        self.kept: dict[bytes, dict[int, Any]] = {}
        """Messages of the answers, by publisher and number."""
        self.late_joiners = late_joiners
        self._waiting: deque[Any] = deque()
        self._first = dict(late_joiners.first)
        """By publisher, the number of the first message that arrived here without being asked for."""
        self._given: dict[bytes, int] = {}
        """By publisher of which only kept messages have come, the highest number: up to it, arrivals are duplicates."""

    @classmethod
    def of(cls, target: Subscription[Any], late_joiners: LateJoiners) -> Gate:
        """Return the gate in front of a subscription's queue; a subscription without one gets a new gate."""
        gate = target.link if isinstance(target.link, Gate) else cls(target, late_joiners)
        gate.late_joiners = late_joiners  # the late joiners of a closed inlet see no more messages
        target.link = gate
        return gate

    def hold_queue(self) -> None:
        """Move the subscription's queued messages into the gate, because earlier ones come first."""
        self._waiting.extend(self.target.queue.items)
        self.target.queue.items.clear()

    @property
    def held(self) -> int:
        """How many messages wait."""
        return len(self._waiting)

    def carry(self, item: Any) -> None:
        """Deliver a message after the earlier ones; one that was among them is not counted again."""
        gid, sequence = self.late_joiners.delivering or (b"", 0)
        if gid:
            self._first.setdefault(gid, sequence)
        if gid and sequence <= self._given.get(gid, 0):
            self.target.discount_duplicate()
        elif self.questions:
            self._waiting.append(item)
            if len(self._waiting) > _MOST_MESSAGES:
                self.target.receive(self._waiting.popleft())
        else:
            self.target.receive(item)

    def open(self) -> None:
        """Deliver the kept messages, and then those that arrived meanwhile."""
        earlier: list[Any] = []
        for gid, items in self.kept.items():
            first = self._first.get(gid, max(items) + 1)
            numbers = sorted(number for number in items if number < first)
            earlier += [items[number] for number in numbers]
            if gid not in self._first and numbers:
                self._given[gid] = numbers[-1]
        self.kept = {}
        room = max(0, self.target.endpoint.qos.depth - len(self._waiting))
        self.target.receive_earlier(earlier[max(0, len(earlier) - room) :])
        while self._waiting:
            self.target.receive(self._waiting.popleft())


def has_expired(publisher: Publisher[Any], sent: Attachment, clock: Clock) -> bool:
    """Return whether a message outlived its lifespan, by wall time, on its way or while its publisher kept it."""
    lifespan_s = publisher.endpoint.qos.lifespan_s
    return lifespan_s is not None and clock.now().nanoseconds - sent.stamp_ns > lifespan_s * NS_PER_S
