"""Channels of a recording: names, types and encodings, and the numbers that they have in a file."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.recording.bag.offered_qos import offered_qos_profiles
from busflow.recording.mcap.writer import LARGE, Payload, size_of

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint
    from busflow.bus.qos import QoS
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.message import Message
    from busflow.recording.recorder.recording_file import RecordingFile
    from busflow.recording.recorder.spool import Spool


class Announcer:
    """The numbers that the channels and types of one file have."""

    def __init__(self) -> None:
        # By the hash too: two classes of one name, or one that was edited, are two types.
        self._schemas: dict[tuple[str, str], int] = {}
        self._channels = 0

    def announce(
        self,
        spool: Spool,
        topic: str,
        type_: TypeSupport | ForeignType,
        offered: Iterable[QoS],
        nodes: Collection[str] = (),
    ) -> int:
        """Declare a channel that these nodes publish, and its type if it is new.

        Returns:
            Its number, 0 if nothing can be written.
        """
        number, key = self._channels + 1, (type_.name, type_.type_hash)
        known = self._schemas.get(key)
        schema = known or len(self._schemas) + 1
        # What ROS 2's recorder writes beside a channel.
        metadata = {"offered_qos_profiles": offered_qos_profiles(offered), "topic_type_hash": type_.type_hash}
        if nodes:
            metadata["callerid"] = ", ".join(nodes)  # the name under which viewers draw a topic's publisher

        def announce(file: RecordingFile) -> None:
            if known is None:
                file.add_schema(schema, type_.name, type_.definition_encoding, type_.definition.encode())
            file.add_channel(number, topic, type_.encoding, schema, metadata)

        if not spool.do(announce):
            return 0
        self._schemas[key], self._channels = schema, number
        return number


@dataclass(slots=True)
class Track:
    """A track: everything that is recorded under one name."""

    topic: str
    support: TypeSupport
    encode: Callable[[Message], Payload]
    """Gives a large message in parts, of which none is copied."""
    offered: list[QoS] = field(default_factory=list["QoS"])
    """The offered QoS by publisher, so far."""
    nodes: list[str] = field(default_factory=list[str])
    """The nodes that have had a publisher, so far."""
    announced: int = 0
    """How many of these nodes its channel names."""
    number: int = 0
    """The number of its channel; 0 before its first message."""
    _publishers: set[Endpoint] = field(default_factory=set["Endpoint"])

    def offer(self, publisher: Endpoint) -> None:
        """Record a publisher; that of a restarted node is known already."""
        if publisher in self._publishers:
            return
        self._publishers.add(publisher)
        if not self.number:
            self.offered.append(publisher.qos)
        if publisher.node not in self.nodes:
            self.nodes.append(publisher.node)


class Tracks:
    """The tracks by name."""

    def __init__(self) -> None:
        self.by_topic: dict[str, Track] = {}
        self._supports: dict[type[Any], TypeSupport] = {}
        self._announcer = Announcer()

    def add(self, topic: str, message_type: type[Message]) -> Track:
        """Add a track for a topic, and return it."""
        support = self._supports.get(message_type)
        if support is None:
            support = self._supports[message_type] = TypeSupport(message_type)
        track = self.by_topic[topic] = Track(topic, support, _encoder(support))
        return track

    def own(self, topic: str, message_type: type[Message], qos: QoS) -> Track:
        """Return the track of messages that the recorder makes itself."""
        track = self.by_topic.get(topic)
        if track is None:
            track = self.add(topic, message_type)
            track.offered.append(qos)
        return track

    def announce(self, spool: Spool, track: Track) -> bool:
        """Declare a track before its first message; False if nothing can be written any more."""
        track.announced = len(track.nodes)
        track.number = self._announcer.announce(spool, track.topic, track.support, track.offered, track.nodes)
        return track.number > 0

    def later_publishers(self) -> dict[str, list[str]]:
        """Return, by topic, the nodes whose first publisher came after the channel had been declared."""
        found = {each.topic: each.nodes[each.announced :] for each in self.by_topic.values() if each.number}
        return {topic: nodes for topic, nodes in found.items() if nodes}


def _encoder(support: TypeSupport) -> Callable[[Message], Payload]:
    if not support.is_heavy:
        return support.encode
    encode = support.encode_in_parts

    def encode_large(message: Message) -> Payload:
        parts = encode(message)
        for part in parts:
            if type(part) is not bytes:
                break
        else:  # no array in it is large
            return b"".join(parts)
        views = [part if isinstance(part, bytes) else memoryview(part).cast("B") for part in parts]
        return views if size_of(views) >= LARGE else b"".join(views)

    return encode_large
