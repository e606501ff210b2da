"""Outlet: sends one publisher's messages to other processes. Encodes nothing until another process subscribes."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow.bus.publisher import Publisher
from busflow.bus.qos import Reliability
from busflow.bus.statistics import EARLY, UNSENT
from busflow.errors import MalformedMessage
from busflow.interfaces.message import Message
from busflow.wire.mirror.held_messages import HeldMessages
from busflow.wire.zenoh.keys import Token, attachment_bytes, topic_key
from busflow.wire.zenoh.sender import LARGE, LARGEST

if TYPE_CHECKING:
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.wire.mirror.connection import Connection

    _Way = zenoh.Publisher | zenoh.ext.AdvancedPublisher

_HEARTBEAT_S = 0.5
_BULKY = 8 * 1024
"""The limit for message types that are mostly bytes, so that clouds and compressed images count as large too."""


class Outlet:
    """Encodes and sends a publisher's messages while another process subscribes.

    A transient_local publisher's are sent without a subscriber too: Zenoh keeps the last for late joiners, as bytes.

    Small messages are sent on the event loop, with Zenoh's usual priority. With its first large message an outlet
    changes to the next lower priority, which only the sender's thread uses, and stays there, so that order is kept.
    Zenoh sends the upper priority first, and the loop never waits behind a message of many pieces.

    A process opens its inlet when it sees a topic's first publisher. So the first messages of a new publisher, and
    those after the topic's first subscription has come, are held until every process has let the publisher in.
    """

    _way: _Way | None  # None once it is closed, when the sender may still hold messages

    def __init__(
        self,
        publisher: Publisher[Any],
        token: Token,
        connection: Connection,
        *,
        expected: int,
        on_open: Callable[[], None],
    ) -> None:
        """Declare the publisher to other processes.

        Args:
            publisher: the publisher whose messages it sends.
            token: the token that shows it to other processes.
            connection: where its messages go.
            expected: depth of the deepest subscription elsewhere that has not let the publisher in; 0 without any.
            on_open: is called whenever it has opened or closed.
        """
        self._connection, self._on_open = connection, on_open
        self.sent: int = 0
        session, support = connection.session, connection.supports(publisher.type)
        self._publisher, self._support, self._gid = publisher, support, token.gid
        self._clock, self._sender, self._log = connection.bus.clock, connection.sender, connection.log
        self._wanted = self._closed = False
        latched = publisher.endpoint.qos.latched
        self._room = 0 if latched else expected
        """Number of messages to hold; 0 while none are held."""
        self._is_new = self._room > 0
        self._held: HeldMessages | None = None
        self._limit = _BULKY if support.is_bulky else LARGE
        """Messages from this size on are large; after the first large one, all are."""
        self._lower: Callable[[], zenoh.Publisher] | None = None
        """Declares the publisher with the lower priority; None for a transient_local one, which has its type's."""
        if latched:
            self._way = _latched(session, publisher, support)
            self._limit = 0 if support.is_bulky else LARGE
        else:
            self._way = _plain(session, publisher, support, zenoh.Priority.DATA)
            self._lower = partial(_plain, session, publisher, support, zenoh.Priority.DATA_LOW)
        self._ways: list[_Way] = [self._way]
        self._token = session.liveliness().declare_token(str(token))
        if latched:
            self._want(True)
        else:
            self._listen(connection.on_loop)

    @property
    def publisher(self) -> Publisher[Any]:
        """The publisher whose messages this sends."""
        return self._publisher

    @property
    def open(self) -> bool:
        """Whether published messages leave the process."""
        return self._wanted

    def look(self) -> None:
        """Ask Zenoh now whether another process subscribes; its notification may come later."""
        way: Any = self._way
        if way is not None and not self._wanted:
            self._want(way.matching_status.matching)

    def expect(self, depth: int) -> None:
        """Hold what is published next for subscriptions that have come, the deepest of this depth; 0 if none is left.

        An open outlet holds up nothing for one more receiver.
        """
        if not self._wanted and self._held is None and not self._closed:
            self._room = depth
            self._install()

    def follow(self, publisher: Publisher[Any]) -> None:
        """Send the messages of the publisher that has replaced this one after a restart of its node."""
        self._publisher = publisher
        self._want(self._wanted)

    def close(self) -> None:
        """Undeclare the publisher."""
        if self._held is not None:
            self._let_go(all_answered=False)
        self._closed = True
        self._publisher.send_through(None)
        self._token.undeclare()
        # Let go of, they are undeclared without the interpreter's lock. `undeclare` of one that keeps what it sends
        # waits with it for a thread of Zenoh, which may wait for the lock to report listeners: for ten seconds.
        self._way = None
        self._ways.clear()

    def _listen(self, on_loop: Callable[..., None]) -> None:
        def on_match(status: Any) -> None:
            on_loop(self._want, status.matching)

        way: Any = self._way
        self._matching = way.declare_matching_listener(zenoh.handlers.Callback(on_match, indirect=False))
        self._want(way.matching_status.matching)

    def _want(self, wanted: bool) -> None:
        if self._closed:
            return
        self._wanted = wanted
        if wanted and self._held is None and not self._is_new:
            self._room = 0
        self._install()
        self._on_open()

    def _install(self) -> None:
        self._publisher.send_through(self._send if self._wanted or self._room else None)

    def _let_go(self, all_answered: bool) -> None:
        """Send what was held if another process receives it. If all have answered, what none receives is no loss."""
        held, self._held = self._held, None
        if held is None or self._closed:
            return
        self._room, self._is_new = 0, False
        self.look()
        messages = held.release()
        if self._wanted:
            for payload, attachment in messages:
                self._pass_on(payload, attachment)
        missed = held.dropped if self._wanted or all_answered else held.dropped + len(messages)
        if missed:
            self._connection.bus.topics[self._publisher.topic].losses[EARLY] += missed
        self._install()

    def _send(self, message: Message) -> None:
        try:
            payload = self._encoded(message)
        except MalformedMessage as error:
            self._refuse(error)
            return
        attachment = attachment_bytes(self._publisher.published, self._clock.now_ns(), self._gid)
        if self._room:
            if self._held is None:
                self._held = HeldMessages(self._connection, self._room, self._let_go)
            self._held.add(payload, attachment)
        else:
            self._pass_on(payload, attachment)

    def _encoded(self, message: Message) -> bytes:
        payload = self._support.encode(message)
        if len(payload) > LARGEST:
            raise MalformedMessage(f"{len(payload):,} bytes are too large a message; {LARGEST:,} may be sent")
        return payload

    def _refuse(self, why: MalformedMessage) -> None:
        """Count a message that cannot be sent, and say so once."""
        topic = self._publisher.topic
        losses = self._connection.bus.topics[topic].losses
        losses[UNSENT] += 1
        if losses[UNSENT] == 1:
            self._log.warning(f"what is published on {topic} cannot leave the process: {why}")

    def _pass_on(self, payload: bytes, attachment: bytes) -> None:
        self.sent += 1
        if len(payload) < self._limit:
            self._put(payload, attachment)
        else:
            self._be_large()
            self._sender.hand(partial(self._put, payload, attachment), len(payload))

    def _be_large(self) -> None:
        self._limit = 0
        if self._lower is not None:
            self._way, self._lower = self._lower(), None
            self._ways.append(self._way)

    def _put(self, payload: bytes, attachment: bytes) -> None:
        way = self._way
        if way is None:
            return
        try:
            way.put(payload, attachment=attachment)
        except zenoh.ZError as error:  # the session is closed, at the end of a run
            self._log.debug(f"not sent on {self._publisher.topic}: {error}")


def _plain(
    session: zenoh.Session, publisher: Publisher[Any], support: TypeSupport, priority: zenoh.Priority
) -> zenoh.Publisher:
    return session.declare_publisher(
        topic_key(publisher.topic, support.name, support.type_hash),
        priority=priority,
        **_manner(publisher),
    )


def _latched(session: zenoh.Session, publisher: Publisher[Any], support: TypeSupport) -> zenoh.ext.AdvancedPublisher:
    """Declare a transient_local publisher in the way of `rmw_zenoh`."""
    reliable = publisher.endpoint.qos.reliability is not Reliability.BEST_EFFORT
    return zenoh.ext.declare_advanced_publisher(
        session,
        topic_key(publisher.topic, support.name, support.type_hash),
        cache=zenoh.ext.CacheConfig(max_samples=publisher.endpoint.qos.depth),
        publisher_detection=True,
        # Without it Zenoh would number what it keeps by time stamps, which each message would have to carry.
        sample_miss_detection=zenoh.ext.MissDetectionConfig(
            heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S if reliable else None
        ),
        priority=zenoh.Priority.DATA_LOW if support.is_bulky else zenoh.Priority.DATA,
        **_manner(publisher),
    )


def _manner(publisher: Publisher[Any]) -> dict[str, Any]:
    """Return the Zenoh settings that all messages of a publisher share."""
    best_effort = publisher.endpoint.qos.reliability is Reliability.BEST_EFFORT
    return {
        "congestion_control": zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.BEST_EFFORT if best_effort else zenoh.Reliability.RELIABLE,
        "allowed_destination": zenoh.Locality.REMOTE,  # who listens here has the message itself
    }
