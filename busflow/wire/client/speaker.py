"""Speaker: publishes on one topic of a run for a client."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import threading
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow.wire.zenoh.keys import Attachment, Token
from busflow.wire.zenoh.qos_text import WireQoS, from_text

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.interfaces.encoding.foreign import ForeignType


class Speaker:
    """A client's publisher on one topic."""

    def __init__(
        self, publishers: Sequence[Any], plain: Sequence[zenoh.Publisher], type_: ForeignType, gid: bytes, clock: Clock
    ) -> None:
        """Create a speaker; `publishers` may keep messages, and then only the `plain` ones report subscriptions."""
        self.published: int = 0
        self._publishers, self._type, self._gid, self._clock = publishers, type_, gid, clock
        self._matched = threading.Event()
        self._matched_keys: set[str] = set()
        self._matching = [self._listen(each) for each in plain]

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
        attachment = Attachment(self.published, self._clock.now_ns(), self._gid).encode()
        for publisher in self._publishers:
            publisher.put(payload, attachment=attachment)

    def _listen(self, plain: Any) -> zenoh.MatchingListener[None]:
        key = str(plain.key_expr)
        listener = plain.declare_matching_listener(
            zenoh.handlers.Callback(lambda status: self._on_match(key, status), indirect=False)
        )
        self._on_match(key, plain.matching_status)
        return listener

    def _on_match(self, key: str, status: Any) -> None:
        (self._matched_keys.add if status.matching else self._matched_keys.discard)(key)
        if self._matched_keys:
            self._matched.set()
        else:
            self._matched.clear()


@contextmanager
def speaking(
    session: zenoh.Session, token: Token, type_: ForeignType, qos: str, *, keys: Sequence[str]
) -> Generator[Speaker]:
    """Publish for this token, under all these keys, while the block lasts.

    Messages are kept for late subscriptions if `qos` says so.
    """
    from busflow.clock import SystemClock  # a client that only looks does not pay for asyncio

    publishers = [_publisher(session, key, from_text(qos)) for key in keys]
    plain = [session.declare_publisher(key) for key in keys]  # one that keeps messages reports no subscriptions
    try:
        yield Speaker(publishers, plain, type_, token.gid, SystemClock())
    finally:
        for each in (*publishers, *plain):
            each.undeclare()


def _publisher(session: zenoh.Session, key: str, qos: WireQoS) -> Any:
    drop = zenoh.CongestionControl.DROP
    if not qos.latched:
        return session.declare_publisher(key, congestion_control=drop)
    return zenoh.ext.declare_advanced_publisher(
        session,
        key,
        cache=zenoh.ext.CacheConfig(max_samples=qos.depth),
        sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
        publisher_detection=True,
        congestion_control=drop,
    )
