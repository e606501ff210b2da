"""Late joiners: transient_local subscriptions that want more kept messages than the inlet has asked for.

The inlet asks the remote publishers once more for what they keep. Until the answer is here, arriving messages wait
before the late joiner's queue. So no subscription gets a message twice, or before an earlier one. Other subscriptions
do not wait.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections import deque
from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, cast

import zenoh

from busflow.bus.expiry import NS_PER_S
from busflow.bus.publisher import Publisher
from busflow.errors import MalformedMessage
from busflow.wire.zenoh.keys import Attachment

if TYPE_CHECKING:
    from busflow.bus.subscription import Subscription
    from busflow.bus.topic import Receiver, Topic
    from busflow.clock import Clock
    from busflow.wire.mirror.connection import Connection

_PATIENCE_S = 2.0
"""How long publishers may take to answer; then a late joiner goes on with the messages that arrive."""
_MOST = 10_000
"""Limit of the messages accepted in an answer, and of those that may wait."""


class LateJoiners:
    """The late joiners of one topic."""

    def __init__(
        self,
        topic: Topic[Any],
        key: str,
        publishers: Mapping[bytes, Publisher[Any]],
        connection: Connection,
        *,
        asked: int,
    ) -> None:
        """Start without late joiners.

        Args:
            topic: what they receive.
            key: under which its messages travel.
            publishers: those elsewhere that are let in, by their signature.
            connection: where they are asked.
            asked: how many kept messages of each publisher come anyhow.
        """
        self.present: tuple[bytes, int] | None = None
        """Publisher and number of the message that is being delivered; None for a local publisher's."""
        self.first: dict[bytes, int] = {}
        """By publisher, the number of its earliest message known here."""
        self._topic, self._key, self._publishers, self._connection = topic, key, publishers, connection
        self._asked = asked
        self._had: dict[bytes, int] = {}
        self._gates: list[Gate] = []
        self._remembered: dict[bytes, dict[int, Any]] = {}
        """By publisher and number, the kept messages that have not arrived by themselves."""

    def note(self, gid: bytes, sequence: int) -> None:
        """Note the message that is about to be delivered; its publisher's token may still be on its way."""
        self.present = gid, sequence
        self.first.setdefault(gid, sequence)
        remembered = self._remembered.get(gid)
        if remembered and (item := remembered.pop(sequence, None)) is not None:
            self._publishers[gid].forget(item)

    def welcome(self, gid: bytes, newcomers: Collection[Subscription[Any]] | None) -> None:
        """Ask a publisher that has come for its kept messages, for subscriptions that want more than come anyhow.

        Of one that was here before and has been away nothing comes anyhow, and only the `newcomers` lack it.
        """
        if newcomers is not None:
            self._had[gid] = 0
        for subscription in self._topic.subscriptions if newcomers is None else newcomers:
            if self._lacks(subscription, gid):
                self._ask(Gate.of(cast("Subscription[Any]", subscription), self), [gid])

    def forget(self, gid: bytes) -> None:
        """Forget a publisher that has gone."""
        for book in (self.first, self._had, self._remembered):
            book.pop(gid, None)

    def serve(self, subscription: Subscription[Any]) -> None:
        """Ask for the kept messages that a new subscription lacks; no message has been read from it yet."""
        lacking = [gid for gid in self._publishers if self._lacks(subscription, gid)]
        if lacking:
            gate = Gate.of(subscription, self)
            gate.hold_back_what_it_has()
            self._ask(gate, lacking)

    def close(self) -> None:
        """Let every late joiner go on with what has arrived."""
        for gate in tuple(self._gates):
            self._let_go(gate)

    def _lacks(self, subscription: Receiver, gid: bytes) -> bool:
        """Return whether a subscription wants more of a publisher's kept messages than are here or on their way."""
        publisher, qos = self._publishers[gid], subscription.endpoint.qos
        if not (qos.latched and publisher.endpoint.qos.latched):
            return False
        wanted = min(qos.depth, publisher.endpoint.qos.depth)
        return wanted > max(self._had.get(gid, self._asked), len(publisher.history))

    def _ask(self, gate: Gate, publishers: Collection[bytes]) -> None:
        gate.questions += 1
        if gate not in self._gates:
            self._gates.append(gate)
        self._topic.rebuild()
        found: list[tuple[bytes, bytes]] = []

        def take(reply: zenoh.Reply) -> None:
            if reply.ok is not None and reply.ok.attachment is not None and len(found) < _MOST:
                found.append((reply.ok.attachment.to_bytes(), reply.ok.payload.to_bytes()))

        def end() -> None:
            self._connection.on_loop(self._answered, gate, publishers, found)

        callback: Any = zenoh.handlers.Callback(take, drop=end, indirect=False)
        self._connection.session.get(
            # Where an advanced publisher, also one of ROS 2, answers what it keeps.
            f"{self._key}/@adv/**?_max={gate.target.endpoint.qos.depth}",
            callback,
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            accept_replies=zenoh.ReplyKeyExpr.ANY,
            allowed_destination=zenoh.Locality.REMOTE,
            timeout=_PATIENCE_S,
        )

    def _answered(self, gate: Gate, asked: Collection[bytes], found: Collection[tuple[bytes, bytes]]) -> None:
        if gate not in self._gates:
            return  # the topic is received no more
        support = self._connection.supports(self._topic.type)
        for attachment, payload in found:
            try:
                sent = Attachment.decode(attachment)
                publisher = self._publishers.get(sent.gid)
                if publisher is not None and sent.gid in asked and not has_expired(publisher, sent, self._topic.clock):
                    item = publisher.as_kept(support.decode(payload))
                    gate.kept.setdefault(sent.gid, {})[sent.sequence] = item
            except MalformedMessage:
                self._topic.losses["malformed"] += 1
        for gid in asked:
            self._had[gid] = max(gate.target.endpoint.qos.depth, self._had.get(gid, 0))
        gate.questions -= 1
        if not gate.questions:
            self._let_go(gate)

    def _let_go(self, gate: Gate) -> None:
        self._gates.remove(gate)
        for gid, items in gate.kept.items():
            if publisher := self._publishers.get(gid):  # else it has gone meanwhile, and keeps nothing any more
                first = self.first.get(gid, max(items) + 1)
                earlier = {number: items[number] for number in sorted(items) if number < first}
                publisher.remember(tuple(earlier.values()))
                self._remembered.setdefault(gid, {}).update(earlier)
                self.first[gid] = min(first, *items)
        if gate.target in self._topic.subscriptions:
            gate.open()
            self._topic.rebuild()


class Gate:
    """Holds back a late joiner's messages until the earlier ones are in its queue."""

    def __init__(self, target: Subscription[Any], late_joiners: LateJoiners) -> None:
        self.target = target
        self.questions = 0
        """Number of unanswered queries; the gate is shut until it is 0."""
        self.kept: dict[bytes, dict[int, Any]] = {}
        """Messages of the answers, by publisher and number."""
        self.late_joiners = late_joiners
        self._waiting: deque[Any] = deque()
        self._first = dict(late_joiners.first)
        """By publisher, the number of the first message that arrives here by itself."""
        self._given: dict[bytes, int] = {}
        """By publisher, the number up to which the late joiner has messages that may still arrive here too."""

    @classmethod
    def of(cls, target: Subscription[Any], late_joiners: LateJoiners) -> Gate:
        """Return the gate before a subscription, a new one if it has none."""
        gate = target.link if isinstance(target.link, Gate) else cls(target, late_joiners)
        gate.late_joiners = late_joiners  # those of an earlier inlet get no messages any more
        target.link = gate
        return gate

    def hold_back_what_it_has(self) -> None:
        """Move the subscription's queued messages into the gate, because earlier ones come first."""
        self._waiting.extend(self.target.queue.items)
        self.target.queue.items.clear()

    @property
    def held(self) -> int:
        """How many messages wait."""
        return len(self._waiting)

    def carry(self, item: Any) -> None:
        """Deliver a message behind the earlier ones, unless it was among them."""
        gid, sequence = self.late_joiners.present or (b"", 0)
        if gid:
            self._first.setdefault(gid, sequence)
        if gid and sequence <= self._given.get(gid, 0):
            self.target.discount_duplicate()
        elif self.questions:
            self._waiting.append(item)
            if len(self._waiting) > _MOST:
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
    """Return whether a message outlived its lifespan in transit or storage, by wall time."""
    lifespan_s = publisher.endpoint.qos.lifespan_s
    return lifespan_s is not None and clock.now().nanoseconds - sent.stamp_ns > lifespan_s * NS_PER_S
