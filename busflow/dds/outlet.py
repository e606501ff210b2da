"""TopicOutlet: carries the messages of one topic from the run to DDS, with a writer for each publisher."""

# The stubs of zenoh and cyclonedds leave out what many of their functions take and return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext
from cyclonedds.core import DDSException

from busflow.dds.names import DdsName, NameUse, user_data
from busflow.errors import MalformedMessage
from busflow.wire.zenoh.keys import Attachment, Token, topic_key
from busflow.wire.zenoh.qos_text import from_text
from busflow.wire.zenoh.sender import LARGE, SenderThread

if TYPE_CHECKING:
    from cyclonedds.pub import DataWriter

    from busflow.dds.calls import BridgeParts
    from busflow.interfaces.encoding.foreign import ForeignType


@dataclass(slots=True)
class _Publisher:
    """A publisher of the run, and its writer in the domain."""

    writer: DataWriter[Any]
    kept: int
    """How many messages it keeps for late joiners."""
    last: int = 0
    """The number of the last message."""


class TopicOutlet:
    """Carries one topic's messages out of the run. They are received only while a neighbour reads the topic."""

    def __init__(self, token: Token, type_: ForeignType, parts: BridgeParts) -> None:
        """Create an outlet without publishers; the token is that of the first.

        Raises:
            UnknownType: DDS cannot describe the type.
        """
        self._topic, self._type, self._session, self._participant = token.topic, type_, parts.session, parts.participant
        self._key = topic_key(token.topic, type_.name, type_.type_hash, domain=token.domain)
        self._carrier, self._carried = parts.carriers.of(type_), parts.carried
        self._publishers: dict[bytes, _Publisher] = {}
        self._subscriber: Any = None
        self._sender = SenderThread(
            f"busflow.dds{token.topic}", on_error=lambda error: parts.carried.fault(f"{token.topic}: {error}")
        )
        self._in_thread = False
        """True once a message was large: the others then follow it through the thread, so that they stay in order."""

    @property
    def is_unused(self) -> bool:
        """True if it has no publisher."""
        return not self._publishers

    def add(self, token: Token) -> bytes:
        """Create the writer of a publisher; return its gid in DDS."""
        qos = from_text(token.qos)
        stated = user_data(typehash=self._type.type_hash)
        writer = self._participant.writer(DdsName(NameUse.TOPIC, self._topic), self._carrier, qos, stated)
        self._publishers[token.gid] = _Publisher(writer, qos.depth if qos.latched else 0)
        self.listen(is_read=False)  # so that a publisher that keeps messages is asked for them
        return writer.guid.bytes

    def remove(self, token: Token) -> None:
        """Remove the writer of a publisher that has gone."""
        self._publishers.pop(token.gid, None)

    def listen(self, *, is_read: bool) -> None:
        """Receive the topic of the run while a neighbour reads it."""
        if is_read and self._subscriber is None:
            callback: Any = zenoh.handlers.Callback(self._on_sample, indirect=False)
            depth = max((publisher.kept for publisher in self._publishers.values()), default=0)
            history = zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=depth)
            self._subscriber = (
                zenoh.ext.declare_advanced_subscriber(self._session, self._key, callback, history=history)
                if depth
                else self._session.declare_subscriber(self._key, callback)
            )
        elif not is_read and self._subscriber is not None:
            self._subscriber.undeclare()
            self._subscriber = None

    def close(self) -> None:
        """Receive no more, and remove all writers."""
        self.listen(is_read=False)
        self._sender.close()
        self._carried.dropped += self._sender.dropped
        self._publishers.clear()

    def _on_sample(self, sample: zenoh.Sample) -> None:
        """Carry a message; called in Zenoh's thread, in which a small one leaves at once."""
        try:
            stated = Attachment.decode(sample.attachment.to_bytes() if sample.attachment is not None else b"")
        except MalformedMessage:  # a message of no publisher that the run shows
            return
        publisher = self._publishers.get(stated.gid)
        if publisher is None or (publisher.kept and stated.sequence <= publisher.last):  # kept messages come again
            return
        publisher.last = stated.sequence
        payload = sample.payload.to_bytes()
        self._in_thread = self._in_thread or len(payload) >= LARGE
        if self._in_thread:
            self._sender.hand(partial(self._write, publisher, payload), len(payload))
        else:
            self._write(publisher, payload)

    def _write(self, publisher: _Publisher, payload: bytes) -> None:
        try:
            publisher.writer.write(self._carrier.of(payload))
        except DDSException as error:
            if error.code != DDSException.DDS_RETCODE_TIMEOUT:
                self._carried.fault(f"{self._topic} is not carried to DDS: {error.msg}")
            self._carried.dropped += 1
        else:
            self._carried.out_of_run += 1
