"""Topics: the topics that cross the bridge, as both sides have them now."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from typing import TYPE_CHECKING

from busflow.dds.inlet import TopicInlet
from busflow.dds.names import NameUse
from busflow.dds.outlet import TopicOutlet
from busflow.errors import MalformedMessage, UnknownType
from busflow.wire.client.offer import misfits
from busflow.wire.client.speaker import Speaker, speaking
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import WireQoS, from_text

if TYPE_CHECKING:
    from busflow.dds.calls import BridgeParts
    from busflow.dds.known_types import KnownTypes
    from busflow.dds.neighbours import NeighbourEnd
    from busflow.dds.shown import Shown

_Key = tuple[str, str, str]
"""A topic, its type and the type's hash."""


class Topics:
    """The outlets and inlets of all topics."""

    def __init__(self, parts: BridgeParts, types: KnownTypes, shown: Shown) -> None:
        self._parts, self._types, self._shown = parts, types, shown
        self._outlets: dict[_Key, TopicOutlet] = {}
        self._writers: dict[str, tuple[Token, bytes]] = {}
        self._compared: set[tuple[str, bytes]] = set()
        """Pairs of a publisher of the run and a neighbour's reader that have been compared."""
        self._inlets: dict[str, TopicInlet] = {}
        self._speakers: dict[bytes, tuple[Token, ExitStack]] = {}
        """By gid of a neighbour's writer, its token and what ends its speaker."""
        self._ready: list[tuple[TopicInlet, bytes, Speaker | None]] = []

    def update(self, run: Sequence[Token], ends: Sequence[NeighbourEnd]) -> None:
        """Open and close outlets and inlets, as the endpoints of the run and of neighbours need them."""
        ends = [end for end in ends if end.name.use is NameUse.TOPIC]
        self._update_writers({str(token): token for token in run if token.kind is TokenKind.PUBLISHER})
        read = {(end.name.name, end.type) for end in ends if not end.is_writer}
        for (topic, type_name, _), outlet in self._outlets.items():
            outlet.listen(is_read=(topic, type_name) in read)
        self._warn_of_misfits([end for end in ends if not end.is_writer])
        written = [end for end in ends if end.is_writer]
        self._update_inlets([token for token in run if token.kind is TokenKind.SUBSCRIPTION], written)
        self._update_speakers(written)

    def admit(self) -> None:
        """Carry the messages of neighbours' writers that are new; the run knows them by now."""
        ready, self._ready = self._ready, []
        for inlet, gid, speaker in ready:
            inlet.admit(gid, speaker)

    def gids(self, node: str, run: Sequence[Token]) -> tuple[frozenset[bytes], frozenset[bytes]]:
        """Return the gids in DDS of the readers and of the writers of a node of the run."""
        readers = {
            self._inlets[token.topic].gid
            for token in run
            if token.kind is TokenKind.SUBSCRIPTION and token.node_name == node and token.topic in self._inlets
        }
        writers = {gid for token, gid in self._writers.values() if token.node_name == node}
        return frozenset(readers), frozenset(writers)

    def close(self) -> None:
        """Carry nothing any more."""
        for outlet in self._outlets.values():
            outlet.close()
        for inlet in self._inlets.values():
            inlet.close()
        for _, ending in self._speakers.values():
            ending.close()

    def _warn_of_misfits(self, reading: Sequence[NeighbourEnd]) -> None:
        """Log which neighbours do not receive a publisher of the run, and why; DDS itself says nothing."""
        subscriptions = {end.gid: token for end in reading if (token := self._shown.token(end.gid)) is not None}
        for publisher, _ in self._writers.values():
            type_ = self._types.message(*_key(publisher))
            for gid, token in subscriptions.items():
                pair = str(publisher), gid
                if token.topic == publisher.topic and type_ is not None and pair not in self._compared:
                    self._compared.add(pair)
                    for node, why in misfits(type_, publisher.qos, [token]).items():
                        text = f"{node} in DDS does not receive {publisher.node_name} on {token.topic}: {why}"
                        self._parts.carried.warn(text)

    def _update_writers(self, wanted: Mapping[str, Token]) -> None:
        for text in self._writers.keys() - wanted.keys():
            token, _ = self._writers.pop(text)
            self._compared = {pair for pair in self._compared if pair[0] != text}
            outlet = self._outlets[key := _key(token)]
            outlet.remove(token)
            if outlet.is_unused:
                outlet.close()
                del self._outlets[key]
        for text in sorted(wanted.keys() - self._writers.keys()):
            token = wanted[text]
            try:
                if (outlet := self._outlet(token)) is not None:
                    self._writers[text] = token, outlet.add(token)
            except (MalformedMessage, UnknownType) as error:
                self._parts.carried.warn(f"{token.topic} does not cross the bridge to DDS: {error}")

    def _outlet(self, token: Token) -> TopicOutlet | None:
        key = _key(token)
        if key not in self._outlets:
            type_ = self._types.message(*key)
            if type_ is None:
                return None
            self._outlets[key] = TopicOutlet(token, type_, self._parts)
        return self._outlets[key]

    def _update_inlets(self, received: Sequence[Token], written: Sequence[NeighbourEnd]) -> None:
        wanted: dict[str, list[Token]] = {}
        for token in received:
            wanted.setdefault(token.topic, []).append(token)
        for topic, inlet in list(self._inlets.items()):
            first = wanted.get(topic, [None])[0]
            if first is None or (first.type, first.hash) != (inlet.type.name, inlet.type.type_hash):
                self._close_inlet(topic)
        for topic, tokens in wanted.items():
            offered = [end.qos for end in written if end.name.name == topic and end.type == tokens[0].type]
            qos = requested([_qos(token) for token in tokens], offered)
            inlet = self._inlets.get(topic)
            if inlet is None:
                self._open_inlet(topic, tokens[0], qos)
            elif inlet.qos != qos:
                inlet.renew(qos)

    def _close_inlet(self, topic: str) -> None:
        for gid in [gid for gid, (token, _) in self._speakers.items() if token.topic == topic]:
            self._close_speaker(gid)
        self._inlets.pop(topic).close()

    def _open_inlet(self, topic: str, token: Token, qos: WireQoS) -> None:
        type_ = self._types.message(topic, token.type, token.hash)
        if type_ is None:
            return
        try:
            self._inlets[topic] = TopicInlet(topic, type_, qos, self._parts)
        except UnknownType as error:
            self._parts.carried.warn(f"{topic} does not cross the bridge from DDS: {error}")

    def _update_speakers(self, written: Sequence[NeighbourEnd]) -> None:
        wanted = {end.gid: end for end in written if end.name.name in self._inlets}
        for gid, (token, _) in list(self._speakers.items()):
            if gid not in wanted or self._shown.token(gid) != token:
                self._close_speaker(gid)
        for gid in sorted(wanted.keys() - self._speakers.keys()):
            if (token := self._shown.token(gid)) is not None:
                self._open_speaker(wanted[gid], token)

    def _close_speaker(self, gid: bytes) -> None:
        token, ending = self._speakers.pop(gid)
        if (inlet := self._inlets.get(token.topic)) is not None:
            inlet.dismiss(gid)
        ending.close()

    def _open_speaker(self, end: NeighbourEnd, token: Token) -> None:
        topic = end.name.name
        inlet, ending = self._inlets[topic], ExitStack()
        self._speakers[end.gid] = token, ending
        if end.type != inlet.type.name or end.hash not in (None, inlet.type.type_hash):
            other = f"publishes another definition of {end.type} on {topic}; busflow doctor compares both"
            what = other if end.type == inlet.type.name else f"publishes {end.type}, not {inlet.type.name} on {topic}"
            self._parts.carried.warn(f"{token.node_name} in DDS {what}")
            self._ready.append((inlet, end.gid, None))
            return
        keys = self._parts.peer.keys(topic, inlet.type)
        speaker = ending.enter_context(speaking(self._parts.session, token, inlet.type, token.qos, keys=keys))
        self._ready.append((inlet, end.gid, speaker))


def requested(subscriptions: Sequence[WireQoS], offered: Sequence[WireQoS]) -> WireQoS:
    """Return what a reader requests for these subscriptions: all that one of them needs and every writer offers.

    Whether a single writer suffices for a single subscription is decided in the run, by the token of each.
    """
    is_reliable = any(each.reliability != "best_effort" for each in subscriptions)
    is_latched = any(each.latched for each in subscriptions)
    return WireQoS(
        reliability="reliable"
        if is_reliable and all(each.reliability == "reliable" for each in offered)
        else "best_effort",
        durability="transient_local" if is_latched and all(each.latched for each in offered) else "volatile",
        depth=max(each.depth for each in subscriptions),
    )


def _key(token: Token) -> _Key:
    return token.topic, token.type, token.hash


def _qos(token: Token) -> WireQoS:
    try:
        return from_text(token.qos)
    except MalformedMessage:
        return WireQoS(depth=10)
