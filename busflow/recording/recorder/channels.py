"""`Tracks`: what a run is recorded as: under which name, of which type, and how its messages become bytes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.recording.mcap.writer import LARGE, Payload, size_of
from busflow.recording.recorder.announcer import Announcer

if TYPE_CHECKING:
    from busflow.bus.qos import QoS
    from busflow.interfaces.message import Message
    from busflow.recording.recorder.spool import Spool


@dataclass(slots=True)
class Track:
    """What is recorded under one name."""

    topic: str
    support: TypeSupport
    encode: Callable[[Message], Payload]
    """Gives a large message in parts, of which none is copied."""
    offered: list[QoS] = field(default_factory=list["QoS"])
    """By its publishers, so far."""
    number: int = 0
    """Of its channel; 0 before its first message."""


class Tracks:
    """The tracks by name."""

    def __init__(self) -> None:
        self.by_topic: dict[str, Track] = {}
        self._supports: dict[type[Any], TypeSupport] = {}
        self._announcer = Announcer()

    def add(self, topic: str, message_type: type[Message]) -> Track:
        """A track for a topic."""
        support = self._supports.get(message_type)
        if support is None:
            support = self._supports[message_type] = TypeSupport(message_type)
        track = self.by_topic[topic] = Track(topic, support, _encoder(support))
        return track

    def announce(self, spool: Spool, track: Track) -> bool:
        """Tell the file of a track before its first message; False where nothing can be written any more."""
        track.number = self._announcer.announce(spool, track.topic, track.support, track.offered)
        return track.number > 0


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
