"""Publications: topics that one viewer publishes into the run; each is checked when it begins, and each message."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from busflow.commands import Offer, check_full_topic_name, decode_json, known_type, misfits
from busflow.errors import IncompatibleType, MalformedMessage, NoSuchTarget
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.commands import ForeignType, GraphView, Peer, Speaker
    from busflow_ui.foxglove.protocol import ClientChannel

ENCODINGS = ("json", "cdr")
"""Encodings that viewers may publish in. Lichtblick takes the first that it knows, and writes JSON without surplus."""
_MOST = 100
"""Most topics that one viewer may publish."""


@dataclass(frozen=True, slots=True)
class _Publication:
    topic: str
    type: ForeignType
    qos: str
    is_json: bool
    speaker: Speaker
    ending: ExitStack
    misfits: set[str] = field(default_factory=set[str])
    """Nodes of which the viewer knows that they do not receive this."""


class Publications:
    """Topics that one viewer publishes, by the viewer's numbers."""

    def __init__(self, peer: Peer) -> None:
        self._peer = peer
        self._open: dict[int, _Publication] = {}
        self._closed = False

    def begin(self, channel: ClientChannel, graph: GraphView) -> None:
        """Begin to publish a topic; messages arrive once the peer has settled. Blocks until the run answers.

        Raises:
            InvalidName: The topic's name is none.
            UnknownType: Neither the run nor busflow has the type, and the viewer does not define it.
            IncompatibleType: The topic has another one.
            MalformedMessage: The number is in use, the encoding is not offered, or the viewer's definition is none.
        """
        check_full_topic_name(channel.topic)
        if channel.id in self._open or len(self._open) >= _MOST:
            raise MalformedMessage(f"{channel.topic}: its number is in use, or {_MOST} topics are published already")
        type_ = known_type(self._peer, _full(channel.schema), definition=channel.definition)
        if channel.encoding not in (type_.encoding, "json"):
            offered = type_.encoding
            raise MalformedMessage(
                f"{channel.topic}: {printable(channel.encoding)!r} is not offered; publish {offered}"
            )
        there = graph.topics.get(channel.topic)
        if there is not None and type_.name not in there.types:
            raise IncompatibleType(f"{channel.topic} has the type {printable(there.type)}, not {type_.name}")
        qos = Offer().text(each.token for each in (there.subscriptions if there is not None else ()))
        with ExitStack() as ending:
            speaker = ending.enter_context(self._peer.advertise(channel.topic, type_, qos=qos, settle=False))
            is_json = channel.encoding == "json"
            self._open[channel.id] = _Publication(channel.topic, type_, qos, is_json, speaker, ending.pop_all())
        if self._closed:  # meanwhile, in the event loop's thread: `close` has not seen this one
            self.end(channel.id)

    def new_misfits(self, graph: GraphView) -> Iterator[str]:
        """Yield a sentence for each subscription that does not receive what is published here, once."""
        for each in tuple(self._open.values()):  # another thread may begin one meanwhile
            there = graph.topics.get(each.topic)
            ends = (end.token for end in (there.subscriptions if there is not None else ()))
            for node, why in misfits(each.type, each.qos, ends).items():
                if node not in each.misfits:
                    each.misfits.add(node)
                    yield f"{node} does not receive {each.topic}: {why}"

    def publish(self, id_: int, payload: bytes) -> None:
        """Publish a message.

        Raises:
            MalformedMessage: It is none of its type.
            NoSuchTarget: Nothing was begun under this number.
        """
        found = self._open.get(id_)
        if found is None:
            raise NoSuchTarget(f"nothing is published under the number {id_}; advertise it first")
        if found.is_json and found.type.is_ros:
            found.speaker.publish(decode_json(payload, found.type.name))
        else:
            found.speaker.publish_bytes(found.type.without_surplus(payload))

    def end(self, id_: int) -> None:
        """Stop publishing a topic."""
        found = self._open.pop(id_, None)
        if found is not None:
            found.ending.close()

    def close(self) -> None:
        """Stop publishing all topics, also those that another thread is about to begin."""
        self._closed = True
        for id_ in list(self._open):
            self.end(id_)


def _full(name: str) -> str:
    """Return a type's full name, of which viewers may leave out the middle."""
    return name.replace("/", "/msg/") if name.count("/") == 1 else name
