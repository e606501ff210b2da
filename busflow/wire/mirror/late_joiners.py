"""Latecomers: transient_local subscriptions that come when less was asked of publishers elsewhere than they want.

What those keep is asked for once more. Until it is here, what arrives waits before the latecomer's queue, so that
nothing comes twice to anybody, nor anything before what was published earlier. Nobody else waits.
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
from busflow.bus.qos import Durability
from busflow.errors import MalformedMessage
from busflow.wire.zenoh.keys import Attachment

if TYPE_CHECKING:
    from busflow.bus.subscription import Subscription
    from busflow.bus.topic import Receiver, Topic
    from busflow.clock import Clock
    from busflow.wire.mirror.connection import Connection

_PATIENCE_S = 2.0
"""How long publishers may take to tell what they keep; then a latecomer goes on with what arrives."""
_MOST = 10_000
"""Messages that are taken in answer, and that may wait."""


class Latecomers:
    """Those of one topic."""

    def __init__(
        self,
        topic: Topic[Any],
        key: str,
        publishers: Mapping[bytes, Publisher[Any]],
        connection: Connection,
        *,
        asked: int,
    ) -> None:
        """Nobody is late yet.

        Args:
            topic: what they receive.
            key: under which its messages travel.
            publishers: those elsewhere that are let in, by their signature.
            connection: where they are asked.
            asked: how many kept messages of each publisher come anyhow.
        """
        self.present: tuple[bytes, int] | None = None
        """Who published the message that is handed out now, and its number; None where that is somebody here."""
        self.first: dict[bytes, int] = {}
        """By publisher, the number of the earliest message of it that is known here."""
        self._topic, self._key, self._publishers, self._connection = topic, key, publishers, connection
        self._asked = asked
        self._had: dict[bytes, int] = {}
        self._gates: list[Gate] = []

    def hear(self, gid: bytes, sequence: int) -> None:
        """A message is about to be handed out, maybe of a publisher whose token is yet to come."""
        self.present = gid, sequence
        self.first.setdefault(gid, sequence)

    def welcome(self, gid: bytes) -> None:
        """A publisher has been let in: get what it keeps for those who want more than comes anyhow."""
        for subscription in self._topic.subscriptions:
            if self._lacks(subscription, gid):
                self._ask(Gate.of(cast("Subscription[Any]", subscription), self), [gid])

    def forget(self, gid: bytes) -> None:
        """A publisher has gone."""
        self.first.pop(gid, None)
        self._had.pop(gid, None)

    def serve(self, subscription: Subscription[Any]) -> None:
        """Get a subscription that has just come, and was not read from yet, what it lacks of what publishers keep."""
        lacking = [gid for gid in self._publishers if self._lacks(subscription, gid)]
        if lacking:
            gate = Gate.of(subscription, self)
            gate.hold_back_what_it_has()
            self._ask(gate, lacking)

    def close(self) -> None:
        """Let everybody go on with what has arrived."""
        for gate in tuple(self._gates):
            self._let_go(gate)

    def _lacks(self, subscription: Receiver, gid: bytes) -> bool:
        """Whether a subscription wants more of what a publisher keeps than is known here, or on its way."""
        publisher, qos = self._publishers[gid], subscription.endpoint.qos
        ends = qos.durability, publisher.endpoint.qos.durability
        if any(each is not Durability.TRANSIENT_LOCAL for each in ends):
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
            # Where an advanced publisher, also one of ROS 2, tells what it keeps.
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
                told = Attachment.decode(attachment)
                publisher = self._publishers.get(told.gid)
                if publisher is not None and told.gid in asked and not has_expired(publisher, told, self._topic.clock):
                    item = publisher.as_kept(support.decode(payload))
                    gate.kept.setdefault(told.gid, {})[told.sequence] = item
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
                publisher.remember([items[number] for number in sorted(items) if number < first])
                self.first[gid] = min(first, *items)
        if gate.target in self._topic.subscriptions:
            gate.open()
            self._topic.rebuild()


class Gate:
    """Stands before a latecomer's queue, until what was published earlier is in it and from then on."""

    def __init__(self, target: Subscription[Any], latecomers: Latecomers) -> None:
        self.target = target
        self.questions = 0
        """How many are yet to be answered; it is shut as long as there are any."""
        self.kept: dict[bytes, dict[int, Any]] = {}
        """What was told in answer, by publisher and number."""
        self._latecomers = latecomers
        self._waiting: deque[Any] = deque()
        self._first = dict(latecomers.first)
        """By publisher, the number of the first message that comes here without being asked for."""
        self._given: dict[bytes, int] = {}
        """By publisher, up to which number the latecomer has been given what may still be on its way here."""

    @classmethod
    def of(cls, target: Subscription[Any], latecomers: Latecomers) -> Gate:
        """The gate before a subscription."""
        gate = target.link if isinstance(target.link, Gate) else cls(target, latecomers)
        target.link = gate
        return gate

    def hold_back_what_it_has(self) -> None:
        """Have wait what the subscription was given when it came: something earlier is to come before it."""
        self._waiting.extend(self.target.queue.items)
        self.target.queue.items.clear()

    @property
    def held(self) -> int:
        """How many messages wait."""
        return len(self._waiting)

    def carry(self, item: Any) -> None:
        """Bring what is published now, behind what was earlier, unless it was among that."""
        gid, sequence = self._latecomers.present or (b"", 0)
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
        """Give the latecomer what was kept, and then what has arrived meanwhile."""
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


def has_expired(publisher: Publisher[Any], told: Attachment, clock: Clock) -> bool:
    """Whether a message has outlived its lifespan on its way, or where it was kept, by the time of day."""
    lifespan_s = publisher.endpoint.qos.lifespan_s
    return lifespan_s is not None and clock.now().nanoseconds - told.stamp_ns > lifespan_s * NS_PER_S
