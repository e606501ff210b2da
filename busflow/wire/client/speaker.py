"""Speaker: publishes on one topic of a run for a client."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import threading
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow.wire.zenoh.keys import Attachment, Token, topic_key
from busflow.wire.zenoh.qos_text import from_text

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.interfaces.encoding.foreign import ForeignType


class Speaker:
    """A client's publisher on one topic."""

    def __init__(self, publisher: Any, plain: zenoh.Publisher, type_: ForeignType, gid: bytes, clock: Clock) -> None:
        """Create a speaker; `publisher` may keep messages, and then only the `plain` one reports subscriptions."""
        self.published: int = 0
        self._publisher, self._type, self._gid, self._clock = publisher, type_, gid, clock
        self._matched = threading.Event()
        callback: Any = zenoh.handlers.Callback(self._on_match, indirect=False)
        self._matching = plain.declare_matching_listener(callback)
        status: Any = plain.matching_status
        if status.matching:
            self._matched.set()

    def wait_for_listener(self, timeout_s: float | None) -> bool:
        """Wait until the topic has a subscription; False if there was none in time."""
        return self._matched.wait(timeout_s)

    def publish(self, values: Mapping[str, Any]) -> None:
        """Publish one message, given as plain values; what is not given has its default.

        Raises:
            MalformedMessage: a value does not fit.
        """
        self.publish_bytes(self._type.encode(values))

    def publish_bytes(self, payload: bytes) -> None:
        """Publish one encoded message."""
        self.published += 1
        self._publisher.put(payload, attachment=Attachment(self.published, self._clock.now_ns(), self._gid).encode())

    def _on_match(self, status: Any) -> None:
        if status.matching:
            self._matched.set()
        else:
            self._matched.clear()


@contextmanager
def speaking(session: zenoh.Session, token: Token, type_: ForeignType, qos: str) -> Generator[Speaker]:
    """Publish for this token while the block lasts; messages are kept for late subscriptions if `qos` says so."""
    from busflow.clock import SystemClock  # a client that only looks does not pay for asyncio

    key, stated = topic_key(token.topic, type_.name, type_.type_hash, domain=token.domain), from_text(qos)
    drop = zenoh.CongestionControl.DROP
    publisher: Any = (
        zenoh.ext.declare_advanced_publisher(
            session,
            key,
            cache=zenoh.ext.CacheConfig(max_samples=stated.depth),
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
            publisher_detection=True,
            congestion_control=drop,
        )
        if stated.latched
        else session.declare_publisher(key, congestion_control=drop)
    )
    plain = session.declare_publisher(key)  # a publisher that keeps messages does not report its subscriptions
    try:
        yield Speaker(publisher, plain, type_, token.gid, SystemClock())
    finally:
        publisher.undeclare()
        plain.undeclare()
