"""Inlet: one topic's way into the process. What others publish there comes onto the loop in bursts.

A ring takes what arrives and loses its oldest when the loop is busy; it never blocks the link, which other topics
share. One thread drains it, and waits until the loop has taken a burst before it hands over the next but one.
"""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

import asyncio
import threading
from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow.endpoint import Endpoint
from busflow.errors import MalformedMessage, NotRunning, WouldBlock
from busflow.publishers import Publisher
from busflow.qos import Durability, QoS
from busflow.wire.keys import Attachment, Token, topic_key
from busflow.wire.qos_form import from_text

if TYPE_CHECKING:
    from structlog.typing import FilteringBoundLogger

    from busflow.bus import Bus
    from busflow.topic import Topic
    from busflow.wire.typesupport import TypeSupport

_RING = 256
_BURST = 64
_BURSTS_AHEAD = 2
_PATIENCE_S = 5.0
_LAST_WORDS_S = 0.05
"""A token's end overtakes the messages in the ring: the drain has this long to bring the next one."""


class Inlet:
    """Publishes on the bus what publishers in other processes publish; each of them is a publisher of the topic."""

    def __init__(
        self,
        topic: Topic[Any],
        support: TypeSupport,
        *,
        bus: Bus,
        session: zenoh.Session,
        log: FilteringBoundLogger,
        on_loop: Callable[..., None],
    ) -> None:
        """Begin to listen; `on_loop` runs a function on the event loop, from any thread."""
        self.received = 0
        self.losses: Counter[str] = Counter()
        """What did not become a message: `lost` on the way, `malformed`, `refused` by a full blocking queue, or
        `unsigned`, from nobody who is there."""
        self._topic, self._support, self._bus, self._log = topic, support, bus, log
        self._publishers: dict[bytes, Publisher[Any]] = {}
        self._tokens: dict[str, bytes] = {}
        self._sequences: dict[bytes, int] = {}
        self._on_loop = on_loop
        self._ahead = threading.Semaphore(_BURSTS_AHEAD)
        self._closed = False
        key = topic_key(topic.name, support.name, support.type_hash)
        latched = any(each.endpoint.qos.durability is Durability.TRANSIENT_LOCAL for each in topic.subscriptions)
        self._way: Any = _latched(session, key) if latched else _plain(session, key)
        self._thread = threading.Thread(target=self._drain, name=f"busflow.inlet.{topic.name}", daemon=True)
        self._thread.start()

    # Who is there.

    def admit(self, token: Token, endpoint: Endpoint) -> None:
        """Let a publisher of another process publish here.

        Raises:
            IncompatibleQoS: a subscription here requests more than it offers.
        """
        publisher: Publisher[Any] = Publisher(self._topic.type, endpoint)
        self._bus.attach_publisher(publisher)
        self._publishers[token.gid] = publisher
        self._tokens[str(token)] = token.gid

    def dismiss(self, token: Token, then: Callable[[], None]) -> None:
        """A publisher of another process has gone; it leaves the topic when what it sent has come out of the ring."""
        asyncio.get_running_loop().call_later(_LAST_WORDS_S, self._leave, token, self.received, then)

    def _leave(self, token: Token, seen: int, then: Callable[[], None]) -> None:
        if self.received != seen:
            self.dismiss(token, then)
            return
        gid = self._tokens.pop(str(token), None)
        if gid is not None:
            self._publishers.pop(gid).close()
            self._sequences.pop(gid, None)
        then()

    @property
    def deserted(self) -> bool:
        """Whether nobody out there publishes here any more."""
        return not self._publishers

    def close(self) -> None:
        """Listen no more."""
        self._closed = True
        self._way.undeclare()
        self._ahead.release()
        self._thread.join(_PATIENCE_S)
        for publisher in self._publishers.values():
            publisher.close()

    # What arrives.

    def _drain(self) -> None:
        """In the inlet's own thread: take what arrives, a burst at a time."""
        try:
            while not self._closed:
                burst = [self._way.recv()]
                while len(burst) < _BURST and (sample := self._way.try_recv()) is not None:
                    burst.append(sample)
                parts = [(each.payload.to_bytes(), each.attachment and each.attachment.to_bytes()) for each in burst]
                self._ahead.acquire()
                self._on_loop(self._take, parts)
        except zenoh.ZError:
            pass  # closed, which is how a waiting recv() ends

    def _take(self, burst: list[tuple[bytes, bytes | None]]) -> None:
        self._ahead.release()
        if not self._closed:
            self._bus.dispatcher.run_now(lambda: self._publish(burst))

    def _publish(self, burst: list[tuple[bytes, bytes | None]]) -> None:
        for payload, attachment in burst:
            self.received += 1
            try:
                publisher = self._sender(attachment)
                if publisher is None:
                    self.losses["unsigned"] += 1
                else:
                    publisher.publish(self._support.decode(payload))
            except MalformedMessage as error:
                self.losses["malformed"] += 1
                if self.losses["malformed"] == 1:
                    self._log.warning(f"what arrives on {self._topic.name} is no message: {error}")
            except (WouldBlock, NotRunning):  # whoever published is far away: the count is how it is told
                self.losses["refused"] += 1

    def _sender(self, attachment: bytes | None) -> Publisher[Any] | None:
        """Who sent it; one that signs in another way than we do passes for any publisher of its topic."""
        known = None
        if attachment:
            told = Attachment.decode(attachment)
            known = self._publishers.get(told.gid)
            if known is not None:  # what strangers count is not kept: there may be any number of them
                last = self._sequences.get(told.gid, told.sequence - 1)
                self._sequences[told.gid] = told.sequence
                self.losses["lost"] += max(0, told.sequence - last - 1)
        return known or next(iter(self._publishers.values()), None)


def remote_endpoint(token: Token, topic: Topic[Any]) -> Endpoint:
    """What a token says of a publisher in another process.

    Raises:
        MalformedMessage: its QoS is none.
    """
    told = from_text(token.qos)
    words: dict[str, Any] = {
        "depth": max(1, told.depth),
        "reliability": told.reliability,
        "durability": told.durability,
    }
    words["liveliness"] = told.liveliness
    limits = {"deadline": told.deadline_ns, "lifespan": told.lifespan_ns, "lease": told.lease_ns}
    stated = {word: limit / 1e9 for word, limit in limits.items() if limit}
    qos = QoS.model_validate(words | stated)
    return Endpoint(token.node_name, topic.name, topic.type, qos, f"{token.node_name} (another process)", topic.name)


def _plain(session: zenoh.Session, key: str) -> Any:
    return session.declare_subscriber(key, zenoh.handlers.RingChannel(_RING), allowed_origin=zenoh.Locality.REMOTE)


def _latched(session: zenoh.Session, key: str) -> Any:
    """As `rmw_zenoh` declares a transient_local subscription."""
    return zenoh.ext.declare_advanced_subscriber(
        session,
        key,
        zenoh.handlers.RingChannel(_RING),
        allowed_origin=zenoh.Locality.REMOTE,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True, max_samples=_RING),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )
