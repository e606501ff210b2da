"""Outlet: encodes one publisher's messages and sends them to other processes, while one of these subscribes."""

# Zenoh's stubs leave out what many of its methods return.
# pyright: reportUnknownMemberType=false, reportUnknownVariableType=false

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING, Any

import zenoh
import zenoh.ext

from busflow.bus.expiry import fresh
from busflow.bus.publisher import Publisher
from busflow.bus.qos import Reliability
from busflow.bus.statistics import EARLY, UNSENT
from busflow.errors import MalformedMessage
from busflow.interfaces.message import Message
from busflow.wire.line.arena import Pieces
from busflow.wire.mirror.held_messages import HeldMessages
from busflow.wire.zenoh.keys import HUMBLE, Token, attachment_bytes
from busflow.wire.zenoh.sender import LARGE, LARGEST

if TYPE_CHECKING:
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.wire.line.route import Route
    from busflow.wire.mirror.connection import Connection

    _ZenohPublisher = zenoh.Publisher | zenoh.ext.AdvancedPublisher

_HEARTBEAT_S = 0.5
_BULKY = 8 * 1024
"""The size from which messages of types that are mostly bytes count as large: clouds, compressed images."""


class Outlet:
    """Encodes and sends a publisher's messages while another process subscribes.

    The messages of a transient_local publisher are sent without a subscriber too: Zenoh keeps the last ones, as bytes,
    for late joiners.

    Those of a volatile publisher go by the lines to all that receive its key there, and by Zenoh while others
    subscribe. From the first large message on, they are encoded in pieces: arrays are copied once, into shared memory.

    The event loop gives small messages to Zenoh with its usual priority. With its first large message an outlet changes
    to the next lower priority, which only the sender's thread uses, and keeps it for all later messages, so that they
    stay in order. Zenoh sends the higher priority first, and the loop never waits behind a message of many pieces.

    A process opens its inlet when it sees a topic's first publisher. So the outlet holds the first messages of a new
    publisher, and those published after the topic's first subscription has come, until every process has admitted the
    publisher.
    """

    _zenoh_publisher: _ZenohPublisher
    _held: HeldMessages | None
    _humble: _ZenohPublisher | None
    """Sends each message once more while a node of ROS 2 Humble subscribes, whose keys have no hash of the type."""

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
            connection: the session and the sender that its messages go through.
            expected: depth of the deepest subscription in other processes that has not admitted the publisher; 0 if
                there is none.
            on_open: called whenever the outlet has opened or closed.
        """
        self._connection, self._on_open = connection, on_open
        self.sent: int = 0
        session, support = connection.session, connection.supports(publisher.type)
        self._publisher, self._support, self._gid = publisher, support, token.gid
        self.key: str = connection.key(publisher.topic, support)
        """The key under which Zenoh and the lines carry its messages."""
        self._clock, self._sender, self._log = connection.bus.clock, connection.sender, connection.log
        self._wanted = self._matched = self._by_zenoh = self._closed = False
        latched = publisher.endpoint.qos.latched
        self._lines = None if latched else connection.lines
        self._routes: Sequence[Route] = () if self._lines is None else self._lines.routes(self.key)
        """The routes of those that receive its key by a line: always the same list, which the lines keep."""
        self._room = 0 if latched else expected
        """Number of messages that may be held; 0 while none are to be held."""
        self._is_new = self._room > 0
        self._limit = _BULKY if support.is_bulky else LARGE
        """Size from which messages count as large; 0 after the first large one, so that all do."""
        self._encode_in_pieces: Callable[[Message], list[Any]] | None = None
        """Set with the first large message, if the type has arrays."""
        self._humble = self._held = None
        if latched:
            self._zenoh_publisher = _latched(session, self.key, publisher, support)
            self._limit = 0 if support.is_bulky else LARGE
        else:
            self._zenoh_publisher = _plain(session, self.key, publisher, zenoh.Priority.DATA)
        self._zenoh_publishers: list[_ZenohPublisher] = [self._zenoh_publisher]
        self._token = session.liveliness().declare_token(str(token))
        if latched:
            self._set_wanted(True)
        else:
            self._listen(connection.on_loop)

    @property
    def publisher(self) -> Publisher[Any]:
        """The publisher whose messages this sends."""
        return self._publisher

    def reaches(self, session: str) -> bool:
        """Return whether published messages go to this session: by a line, or by Zenoh to all that subscribe there."""
        return self._by_zenoh or any(route.session == session for route in self._routes)

    def check_subscribers(self) -> None:
        """Ask Zenoh whether another process subscribes, because its notification may come later."""
        if not self._closed and not self._by_zenoh:
            self._set_wanted(self._is_matched())

    def check_routes(self) -> None:
        """Open or close, because a process has begun or ceased to receive the key by a line."""
        self._set_wanted(self._matched)

    def expect(self, depth: int) -> None:
        """Hold the next messages for new subscriptions, the deepest of this depth; hold none if it is 0.

        An open outlet sends on: it holds no messages for one more receiver.
        """
        if not self._wanted and self._held is None and not self._closed:
            self._room = depth
            self._install()

    def reach_humble(self, *, is_there: bool) -> None:
        """Send each message under the key of ROS 2 Humble too while nodes of it subscribe; what is kept goes first."""
        if self._closed or is_there is (self._humble is not None):
            return
        self._humble = None
        if is_there:
            session, key = self._connection.session, self._connection.key(self._publisher.topic, self._support, HUMBLE)
            if self._publisher.endpoint.qos.latched:
                self._humble = _latched(session, key, self._publisher, self._support)
                self._send_kept(self._humble)
            else:
                self._humble = _plain(session, key, self._publisher, zenoh.Priority.DATA_LOW)
        self._set_wanted(self._is_matched())

    def follow(self, publisher: Publisher[Any]) -> None:
        """Send the messages of this publisher, which replaces the former one after a restart of its node."""
        self._publisher = publisher
        self._set_wanted(self._matched)

    def close(self) -> None:
        """Undeclare the publisher, once the sender has sent its last messages."""
        if self._held is not None:
            self._end_hold(all_answered=False)
        self._closed = True
        self._publisher.send_through(None)
        undeclare: Any = self._token.undeclare
        self._sender.hand(undeclare)  # others remove the publisher soon after the end of its token
        # The end of the references, of which the sender may hold the last, undeclares the Zenoh publishers without the
        # interpreter's lock. `undeclare` of one that keeps its messages holds the lock while it waits for a thread of
        # Zenoh. If that thread needs the lock to report listeners, both wait for ten seconds.
        del self._zenoh_publisher
        self._humble = None
        self._zenoh_publishers.clear()

    def _listen(self, on_loop: Callable[..., None]) -> None:
        def on_match(status: Any) -> None:
            on_loop(self._set_wanted, status.matching)

        zenoh_publisher: Any = self._zenoh_publisher
        self._matching = zenoh_publisher.declare_matching_listener(zenoh.handlers.Callback(on_match, indirect=False))
        self._set_wanted(self._is_matched())

    def _is_matched(self) -> bool:
        """Return whether another process subscribes; what is kept is sent in any case."""
        zenoh_publisher: Any = self._zenoh_publisher
        return self._publisher.endpoint.qos.latched or zenoh_publisher.matching_status.matching

    def _set_wanted(self, matched: bool) -> None:
        if self._closed:
            return
        self._matched, self._by_zenoh = matched, matched or self._humble is not None
        self._wanted = wanted = self._by_zenoh or bool(self._routes)
        if wanted and self._held is None and not self._is_new:
            self._room = 0
        self._install()
        self._on_open()

    def _install(self) -> None:
        self._publisher.send_through(self._send if self._wanted or self._room else None)

    def _end_hold(self, all_answered: bool) -> None:
        """Send the held messages if another process subscribes; if none does and all have answered, lose nothing."""
        held, self._held = self._held, None
        if held is None or self._closed:
            return
        self._room, self._is_new = 0, False
        if self._lines is not None:
            self._lines.read()
        self.check_subscribers()
        messages = held.release()
        if self._wanted:
            now_ns = self._clock.now_ns()
            for payload, attachment in messages:
                self._pass_on(payload, attachment, now_ns)
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
        now_ns = self._clock.now_ns()
        attachment = attachment_bytes(self._publisher.published, now_ns, self._gid)
        if self._room:
            if self._held is None:
                self._held = HeldMessages(self._connection, self._room, self._end_hold)
            self._held.add(payload if isinstance(payload, bytes) else payload.joined, attachment)
        else:
            self._pass_on(payload, attachment, now_ns)

    def _encoded(self, message: Message) -> bytes | Pieces:
        """Return a message for its ways; in pieces only where a line takes it.

        Raises:
            MalformedMessage: It cannot be encoded, or it is too large.
        """
        if self._encode_in_pieces is not None and self._routes:
            pieces = self._encode_in_pieces(message)
            size = sum(memoryview(piece).nbytes for piece in pieces)
            payload = Pieces(pieces, size)
        else:
            payload = self._support.encode(message)
            size = len(payload)
            if size >= LARGE and self._support.is_heavy:
                self._encode_in_pieces = self._support.encode_in_parts
        if size > LARGEST:
            raise MalformedMessage(f"{size:,} bytes are too large a message; {LARGEST:,} may be sent")
        return payload

    def _refuse(self, why: MalformedMessage) -> None:
        """Count a message that cannot be sent, and log the first."""
        topic = self._publisher.topic
        losses = self._connection.bus.topics[topic].losses
        losses[UNSENT] += 1
        if losses[UNSENT] == 1:
            self._log.warning(f"a message on {topic} cannot leave the process: {why}")

    def _pass_on(self, payload: bytes | Pieces, attachment: bytes, now_ns: int) -> None:
        self.sent += 1
        if self._lines is not None and self._routes:
            self._lines.send(self.key, payload, attachment, now_ns)
        if self._by_zenoh:
            self._put(payload if isinstance(payload, bytes) else payload.joined, attachment)

    def _put(self, payload: bytes, attachment: bytes) -> None:
        """Send a whole message through Zenoh."""
        if self._humble is not None:
            self._pass_to_humble(self._humble, payload, attachment)
        if len(payload) < self._limit:
            self._put_by(self._zenoh_publisher, payload, attachment)
        else:
            self._use_lower_priority()
            self._sender.hand(partial(self._put_by, self._zenoh_publisher, payload, attachment), len(payload))

    def _pass_to_humble(self, humble: _ZenohPublisher, payload: bytes, attachment: bytes) -> None:
        """Send a message of any size in the sender's thread, so that kept and new ones stay in order."""
        self._sender.hand(partial(self._put_by, humble, payload, attachment), len(payload))

    def _send_kept(self, humble: _ZenohPublisher) -> None:
        """Send the messages that the publisher keeps, with their numbers, to nodes of Humble."""
        kept = [fresh(item, self._clock) for _, item in self._publisher.history]
        for number, message in enumerate(kept, self._publisher.published - len(kept) + 1):
            if message is not None:
                with suppress(MalformedMessage):  # it could not be sent before either
                    attachment = attachment_bytes(number, self._clock.now_ns(), self._gid)
                    self._pass_to_humble(humble, self._support.encode(message), attachment)

    def _use_lower_priority(self) -> None:
        """Change to the lower priority with the first large message, unless a transient_local type has decided it."""
        if self._limit and not self._publisher.endpoint.qos.latched:
            session, low = self._connection.session, zenoh.Priority.DATA_LOW
            self._zenoh_publisher = _plain(session, self.key, self._publisher, low)
            self._zenoh_publishers.append(self._zenoh_publisher)
        self._limit = 0

    def _put_by(self, zenoh_publisher: _ZenohPublisher, payload: bytes, attachment: bytes) -> None:
        try:
            zenoh_publisher.put(payload, attachment=attachment)
        except zenoh.ZError as error:  # the session is closed: the run ends
            self._log.debug(f"not sent on {self._publisher.topic}: {error}")


def _plain(session: zenoh.Session, key: str, publisher: Publisher[Any], priority: zenoh.Priority) -> zenoh.Publisher:
    return session.declare_publisher(key, priority=priority, **_settings(publisher))


def _latched(
    session: zenoh.Session, key: str, publisher: Publisher[Any], support: TypeSupport
) -> zenoh.ext.AdvancedPublisher:
    """Declare a transient_local publisher as `rmw_zenoh` does."""
    reliable = publisher.endpoint.qos.reliability is not Reliability.BEST_EFFORT
    return zenoh.ext.declare_advanced_publisher(
        session,
        key,
        cache=zenoh.ext.CacheConfig(max_samples=publisher.endpoint.qos.depth),
        publisher_detection=True,
        # Without this, Zenoh would order the kept messages by time stamps, which each message would have to carry.
        sample_miss_detection=zenoh.ext.MissDetectionConfig(
            heartbeat=None, sporadic_heartbeat=_HEARTBEAT_S if reliable else None
        ),
        priority=zenoh.Priority.DATA_LOW if support.is_bulky else zenoh.Priority.DATA,
        **_settings(publisher),
    )


def _settings(publisher: Publisher[Any]) -> dict[str, Any]:
    """Return the Zenoh settings that all messages of a publisher share."""
    best_effort = publisher.endpoint.qos.reliability is Reliability.BEST_EFFORT
    return {
        "congestion_control": zenoh.CongestionControl.DROP,
        "reliability": zenoh.Reliability.BEST_EFFORT if best_effort else zenoh.Reliability.RELIABLE,
        "allowed_destination": zenoh.Locality.REMOTE,  # a subscription in this process gets the message object itself
    }
