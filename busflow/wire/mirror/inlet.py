"""Inlet: brings one topic's messages from other processes onto the event loop.

Volatile publishers of a session to which there is a line are received by it, and all others through Zenoh, as soon as
there is one. Both kinds of messages meet in one buffer.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable
from functools import partial
from math import inf
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.bus.dispatcher import QUANTUM
from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import Durability, Overflow
from busflow.bus.statistics import END
from busflow.errors import MalformedMessage, NotRunning, WouldBlock
from busflow.interfaces.message import Message
from busflow.wire.line.packets import PIECES, Reason, Wanted
from busflow.wire.mirror.arrival_buffer import CHUNK, ArrivalBuffer, Arrived, Payload, is_large
from busflow.wire.mirror.arrivals import Arrivals
from busflow.wire.mirror.connection import decoded
from busflow.wire.mirror.late_joiners import LateJoiners, has_expired
from busflow.wire.mirror.zenoh_feed import ZenohFeed, ring_size
from busflow.wire.zenoh.keys import GID_AT, SEQUENCE, Attachment, Token
from busflow.wire.zenoh.qos_text import as_qos, from_text
from busflow.wire.zenoh.sender import LARGEST

if TYPE_CHECKING:
    from collections.abc import Sequence

    from busflow.bus.subscription import Subscription
    from busflow.bus.topic import Topic
    from busflow.wire.line import intake as line
    from busflow.wire.mirror.connection import Connection

_MOST_DELAYS = 21
"""Limit of such times in a row; each but the first follows one in which a message of the publisher arrived."""
TOKENS_TAKE = 4
"""Number of such times until the tokens of a process that has ended are gone, also on a busy machine."""
_MOST_DEPTH = 10_000
"""Limit of the messages kept here for late joiners, by remote publisher; its token may state a higher depth."""


class Inlet:
    """Publishes remote publishers' messages on the bus; each remote publisher becomes a publisher of the topic."""

    _depth: int = 0
    """Number of messages in the buffer beyond which the others wait in the feed."""
    _is_shallow: bool = False
    """Whether senders learn before the handlers run that they may send newer messages, which replace others."""
    _has_dropped: bool = False
    """Whether the feed may have dropped messages before those in the buffer."""

    def __init__(
        self, topic: Topic[Any], connection: Connection, *, arrivals: Arrivals, on_lineless: Callable[[str], None]
    ) -> None:
        """Start to receive.

        Args:
            topic: the topic to publish on.
            connection: the Zenoh session, log and bus; the first malformed and the first refused message are logged.
            arrivals: the record of the topic's arrived messages, those of its earlier inlets included. After a broken
                link the same publishers come back. The numbers missing then count as lost, and a message that has
                arrived before is not published again.
            on_lineless: called with the session of a volatile publisher that is received through Zenoh from now on.
        """
        self.received: int = 0
        self.losses: Counter[str] = topic.losses
        self._topic, self._support, self._bus = topic, connection.supports(topic.type), connection.bus
        self._log, self._on_loop, self._connection = connection.log, connection.on_loop, connection
        self._on_lineless = on_lineless
        self._publishers: dict[bytes, Publisher[Any]] = {}
        self._plain: dict[bytes, Publisher[Any]] = {}
        """By gid, the publishers that keep nothing for late joiners and whose messages do not expire."""
        self._by_line: dict[bytes, str] = {}
        """By gid, the session of each publisher that is received by a line."""
        self._intakes: dict[str, line.Intake] = {}
        self._interrupted: set[bytes] = set()
        """The publishers whose line ended: the next gap in their numbers is a loss."""
        self._ignored: set[bytes] = set()
        self._leaving: set[bytes] = set()
        self._arrivals = arrivals
        self._emptying = self._closed = False
        self._renewal: asyncio.TimerHandle | None = None
        """The end of the wait for newer messages of a sender that was held up."""
        self._feeder: asyncio.Task[None] | None = None
        # Nodes of ROS 2 Humble have no hash in their keys. What comes under another hash is of a refused publisher.
        self._key = connection.key(topic.name, self._support, "*" if connection.describes_types else "")
        kept = [each.endpoint.qos for each in topic.subscriptions]
        self._latched = max((qos.depth for qos in kept if qos.latched), default=0)
        """How many kept messages the feed asks of each publisher."""
        self._late_joiners = LateJoiners(
            topic, self._key, self._publishers, connection, numbers=arrivals, asked=self._latched
        )
        self._buffer = ArrivalBuffer(self._support.most_bytes)
        self.suit()
        self._feed: ZenohFeed | None = None
        """Brings what comes through Zenoh, while some publisher is not received by a line."""
        if connection.describes_types:
            self._subscribe()

    # The ways of the messages.

    def _subscribe(self) -> None:
        """Receive through Zenoh from now on."""
        if self._feed is None and not self._closed:
            self._feed = ZenohFeed(
                self._connection.session,
                self._key,
                depth=self._depth,
                latched=self._latched,
                on_sample=partial(self._on_loop, self._empty),
                on_heavy=self._warn,
            )

    def _unsubscribe(self) -> None:
        """Receive through Zenoh no more; nodes of ROS 2 may publish before their token is known here."""
        if self._feed is not None and (self._closed or not self._connection.describes_types):
            self._feed.close()
            self._feed = None

    def _follow(self, session: str) -> bool:
        """Receive the topic from a session by a line; return whether there is one."""
        lines = self._connection.lines
        if lines is not None and session not in self._intakes:
            key = self._connection.key(self._topic.name, self._support)
            take, on_end = partial(self._arrive, session), partial(self._line_ended, session)
            intake = lines.receive(session, key, self._wanted, take, on_end)
            if intake is not None:
                self._intakes[session] = intake
        return session in self._intakes

    def suit(self) -> None:
        """Let the senders keep as much as the deepest queue here does, since subscriptions have come or gone."""
        self._depth = max(self._depth, ring_size(self._topic, self._support))
        wanted = self._wanted
        self._is_shallow = wanted.depth <= PIECES
        for intake in self._intakes.values():
            intake.change(wanted)

    @property
    def _wanted(self) -> Wanted:
        """The depth and overflow of the deepest queue; a tap, e.g. of a recording, takes as much as the buffer."""
        qos = [each.endpoint.qos for each in self._topic.subscriptions]
        depth = max(self._depth if self._topic.taps else self._topic.keeps_newest or 1, *(each.depth for each in qos))
        keeps_oldest = all(each.overflow is Overflow.DROP_NEWEST for each in qos)
        return Wanted(depth, Overflow.DROP_NEWEST if keeps_oldest else Overflow.DROP_OLDEST)

    def _arrive(self, session: str, arrived: Sequence[line.Arrived]) -> None:
        """Take in the messages of an intake, and begin to publish them."""
        if self._closed or session not in self._intakes:
            return
        self._buffer.put(arrived, intake := self._intakes[session])
        if self._renewal is not None:
            self._renewed()
        elif not self._emptying and intake.holds_up and self._skip_overflow():
            # These messages are stale: the sender keeps newer ones back, and learns now that it may send them.
            self._buffer.acknowledge()
            self._emptying, limit_s = True, timeouts.current.newer_messages
            self._renewal = asyncio.get_running_loop().call_later(limit_s, self._renewed)
        else:
            self._empty()

    def _renewed(self) -> None:
        """Publish, since newer messages have come, or since none come."""
        if self._renewal is not None:
            self._renewal.cancel()
            self._renewal = None
            self._go_on()

    def _line_ended(self, session: str) -> None:
        """Receive by another line at once; else through Zenoh, if the session has not ended with the line."""
        gids = [gid for gid, each in self._by_line.items() if each == session]
        self._buffer.put([(Reason.LINK, bytes(GID_AT) + gid) for gid in gids], self._intakes.pop(session))
        self._empty()  # behind what has arrived
        if not self._closed and not self._follow(session):
            asyncio.get_running_loop().call_later(TOKENS_TAKE * timeouts.current.departure, self._leave_line, session)

    def _leave_line(self, session: str) -> None:
        left = [gid for gid, each in self._by_line.items() if each == session and gid not in self._leaving]
        if left and not self._closed and session not in self._intakes:
            self._on_lineless(session)
            for gid in left:
                del self._by_line[gid]
            self._subscribe()

    # Remote publishers.

    def admit(self, token: Token, endpoint: Endpoint) -> None:
        """Add a remote publisher to the topic; calling it again has no effect."""
        self._ignored.discard(token.gid)
        self._leaving.discard(token.gid)
        if token.gid not in self._publishers:
            publisher: Publisher[Any] = Publisher(self._topic.type, endpoint)
            self._bus.attach_publisher(publisher)
            self._publishers[token.gid] = publisher
            if not endpoint.qos.latched and self._follow(token.session):
                self._by_line[token.gid] = token.session
            else:
                self._subscribe()
                if not endpoint.qos.latched:
                    self._on_lineless(token.session)
            if not publisher.perishable and endpoint.qos.durability is Durability.VOLATILE:
                self._plain[token.gid] = publisher
            self._late_joiners.ask_publisher(token.gid, self._arrivals.come(token.gid))

    def serve(self, subscription: Subscription[Any]) -> None:
        """Give a new subscription the messages that publishers keep; ask for those that have not been asked for yet."""
        self._late_joiners.serve(subscription)

    def ignore(self, token: Token) -> None:
        """Discard the messages of an incompatible publisher, and count them as incompatible."""
        self._ignored.add(token.gid)
        self._expel(token.gid)
        self._arrivals.forget(token.gid)

    def dismiss(self, token: Token, then: Callable[[], None]) -> None:
        """Remove a gone publisher once its messages are published, and call `then`; one that comes back stays."""
        self._leaving.add(token.gid)
        self._leave(token, then, _MOST_DELAYS, -1)

    def _leave(self, token: Token, then: Callable[[], None], delays_left: int, seen: int) -> None:
        """Remove it if its line has ended, or if nothing has come since it had published `seen` messages; else wait."""
        if self._closed or token.gid not in self._leaving:
            return
        if self._connection.lines is not None:
            self._connection.lines.read()  # its last messages, or the end of its line, may wait there
        publisher = self._publishers.get(token.gid)
        published = 0 if publisher is None else publisher.published
        is_quiet = token.gid in self._interrupted or published == seen or not delays_left
        if self._emptying or not is_quiet:
            delay_s, left = timeouts.current.departure, max(0, delays_left - 1)
            asyncio.get_running_loop().call_later(delay_s, self._leave, token, then, left, published)
            return
        self._leaving.discard(token.gid)
        self._ignored.discard(token.gid)
        self._expel(token.gid)
        self._arrivals.leave(token.gid)
        then()

    def _expel(self, gid: bytes) -> None:
        publisher = self._publishers.pop(gid, None)
        self._plain.pop(gid, None)
        self._interrupted.discard(gid)
        session = self._by_line.pop(gid, "")
        if session in self._intakes and session not in self._by_line.values():
            intake = self._intakes.pop(session)
            self._buffer.discard(intake)
            intake.close()
        self._late_joiners.forget(gid)
        if publisher is not None:
            publisher.close()
        if self._feed is not None and self._publishers and self._publishers.keys() <= self._by_line.keys():
            self._unsubscribe()

    @property
    def is_unused(self) -> bool:
        """True if no remote publisher is left."""
        return not self._publishers

    def close(self) -> None:
        """Stop receiving."""
        self._closed = True
        for each in (self._feeder, self._renewal):
            if each is not None:
                each.cancel()
        self._late_joiners.close()
        self._unsubscribe()
        for gid in tuple(self._publishers):
            self._expel(gid)

    # Arriving messages.

    def _warn(self) -> None:
        why = f"more than {LARGEST >> 20} MiB of them wait"
        self._on_loop(self._log.warning, f"messages on {self._topic.name} from other processes are dropped: {why}")

    def _pause(self) -> None:
        """Note that all that had come is published."""
        self._emptying = False
        self._buffer.acknowledge()
        if self._feed is not None:
            self._feed.resume()

    def _empty(self) -> None:
        """Begin to publish what is in the buffer, unless that goes on already."""
        if not self._emptying:
            self._emptying = True
            self._go_on()

    def _go_on(self) -> None:
        if self._topic.blocking:
            name = f"busflow.inlet.{self._topic.name}"
            self._feeder = asyncio.get_running_loop().create_task(self._send_all(), name=name)
        else:
            self._take()

    def _take(self) -> None:
        """Publish all that has arrived, for a limited time; then the loop runs other work before the next messages.

        The clock is read after a quantum of messages, and after each large one, whose copy and decoding take long.
        """
        dispatcher, buffer, subscriptions = self._bus.dispatcher, self._buffer, self._topic.subscriptions
        started, handled, is_empty = dispatcher.now(), 0, False
        try:
            while waiting := self._fill():
                if waiting > 1:
                    self._skip_overflow()
                    waiting = len(buffer)
                overflows = waiting > 1 and any(
                    waiting + each.queued > each.endpoint.qos.depth for each in subscriptions
                )
                batch = buffer.take(inf if overflows else CHUNK)  # no handler gets a message that its queue cannot keep
                handled += QUANTUM if is_large(batch[-1]) else len(batch)
                if self._is_shallow:
                    buffer.acknowledge()
                dispatcher.run_now(partial(self._publish, batch))
                if dispatcher.spent(started, handled) or any(each.queued for each in subscriptions):
                    break  # a queue that is not empty now is read by a task, which needs the loop
            else:
                is_empty = True
        finally:  # if one message raises, the others are published all the same
            if is_empty or self._closed:
                self._pause()
            else:
                buffer.acknowledge()
                asyncio.get_running_loop().call_later(0, self._go_on)  # after all timers that are due

    def _fill(self) -> int:
        """Take in what has come through Zenoh but for what lines bring, and return how many messages wait."""
        if self._feed is not None and (waiting := len(self._buffer)) < self._depth:
            samples, has_dropped = self._feed.take()
            self._has_dropped = has_dropped or (self._has_dropped and waiting > 0)
            signed = (
                (each.payload, b"" if each.attachment is None else each.attachment.to_bytes()) for each in samples
            )
            self._buffer.put((each for each in signed if each[1][GID_AT:] not in self._by_line), None)
        return len(self._buffer)

    def _skip_overflow(self) -> bool:
        """Count the messages that every queue would drop at once, instead of decoding them; return if any were."""
        keep = self._topic.keeps_newest
        if keep is None or len(self._buffer) <= keep:
            return False
        skipped = self._buffer.skip(keep, self._plain)
        self.received += len(skipped)
        signed = [(attachment[GID_AT:], *SEQUENCE.unpack_from(attachment)) for attachment in skipped]
        for gid, count in Counter(gid for gid, sequence in signed if self._note(gid, sequence)).items():
            self._topic.count_overflow(self._plain[gid], count)
        return bool(skipped)

    def _note(self, gid: bytes, sequence: int, *, ordered: bool = False) -> bool:
        """Record a message; return False if it is not to be published."""
        is_overflow = gid not in self._interrupted and (gid in self._by_line or self._has_dropped)
        self._interrupted.discard(gid)
        overflowed = self._publishers.get(gid) if is_overflow else None
        return self._arrivals.note(gid, sequence, ordered=ordered, overflowed=overflowed)

    async def _send_all(self) -> None:
        """Publish as fast as the nodes accept messages; if that is too slow, the buffer drops its oldest."""
        try:
            while not self._closed:
                self._fill()
                if not (batch := self._buffer.take(1)):
                    break
                for payload, signature in batch:
                    if (arrival := self._read(payload, signature)) is not None:
                        await self._send(*arrival)
                        await asyncio.sleep(0)
                self._buffer.acknowledge()
        finally:
            self._feeder = None
            self._pause()

    def _publish(self, batch: list[Arrived]) -> None:
        """Publish the messages of a batch; the handlers run after this returns.

        A plain publisher's message with the next number is published here; it takes 1 µs less than any other.
        """
        plain, sequences, decode = self._plain, self._arrivals.last, self._support.decode
        for payload, signature in batch:
            if self._closed:
                return
            publisher = plain.get(gid := signature[GID_AT:])
            if publisher is None or not isinstance(payload, bytes):
                self._publish_carefully(payload, signature)
                continue
            (sequence,) = SEQUENCE.unpack_from(signature)  # it has 33 bytes, else the gid would not be known
            if sequences.get(gid) != sequence - 1:
                self._publish_carefully(payload, signature)
                continue
            sequences[gid] = sequence
            self.received += 1
            try:
                publisher.publish(decode(payload))
            except MalformedMessage as error:
                self._discard(error)
            except (WouldBlock, NotRunning) as error:  # the error cannot reach the remote publisher: it is only counted
                self._refuse(error)

    def _note_dropped(self, reason: Reason, signature: bytes) -> None:
        """Count the messages that a sender dropped after the last one that has arrived, up to this one."""
        gid, (sequence,) = signature[GID_AT:], SEQUENCE.unpack_from(signature)
        publisher = self._publishers.get(gid)
        if reason is Reason.LINK:
            self._interrupted.add(gid)
        elif reason is Reason.END or publisher is None:
            if self._arrivals.note(gid, sequence, reason=END):
                self._topic.count_lost(END, 1)
        elif self._note(gid, sequence):
            self._topic.count_overflow(publisher, 1)

    def _publish_carefully(self, payload: Payload, signature: bytes) -> None:
        """Publish a message of any publisher, after all checks."""
        if (arrival := self._read(payload, signature)) is not None:
            publisher, message = arrival
            try:
                publisher.publish(message)
            except (WouldBlock, NotRunning) as error:
                self._refuse(error)
            finally:
                self._late_joiners.delivering = None

    async def _send(self, publisher: Publisher[Any], message: Message) -> None:
        try:
            await publisher.send(message)
        except (WouldBlock, NotRunning) as error:
            self._refuse(error)
        finally:
            self._late_joiners.delivering = None

    def _refuse(self, error: Exception) -> None:
        self.losses["refused"] += 1
        if self.losses["refused"] == 1:
            self._log.warning(f"a message on {self._topic.name} from another process is refused: {error}")

    def _read(self, payload: Payload, signature: bytes) -> tuple[Publisher[Any], Message] | None:
        """Return the publisher and the message; None if the message is not to be published."""
        if isinstance(payload, Reason):
            return self._note_dropped(payload, signature)
        self.received += 1
        try:
            publisher = self._publisher_of(signature)
            if publisher is None:
                return None
            if isinstance(payload, bytes):
                return publisher, self._support.decode(payload)
            return publisher, decoded(payload, self._support)
        except MalformedMessage as error:
            self._discard(error)
        return None

    def _discard(self, error: MalformedMessage) -> None:
        self.losses["malformed"] += 1
        if self.losses["malformed"] == 1:
            self._log.warning(f"a message on {self._topic.name} from another process is malformed: {error}")

    def _publisher_of(self, attachment: bytes) -> Publisher[Any] | None:
        """Return a message's publisher, or any if its gid is unknown; None if the message is not to be published."""
        known = stated = None
        if attachment:
            stated = Attachment.decode(attachment)
            if stated.gid in self._ignored:
                self.losses["incompatible"] += 1
                return None
            known = self._publishers.get(stated.gid)
            keeps = known is not None and known.endpoint.qos.latched
            if keeps and stated.sequence > 1 and stated.gid not in self._arrivals.last:
                # What it keeps is not here: it was asked before the way to it was known.
                self._late_joiners.ask_again(stated.gid)
            if not self._note(stated.gid, stated.sequence, ordered=keeps):
                return None
        found = known or next(iter(self._publishers.values()), None)
        if found is None:
            self.losses["unsigned"] += 1
        elif stated is not None:
            if has_expired(found, stated, self._bus.clock):
                self.losses["expired"] += 1
                return None
            if stated.gid in self._arrivals.last:  # else `_arrivals` has reached its limit of senders
                self._late_joiners.note(stated.gid, stated.sequence)
        return found


def remote_endpoint(token: Token, topic: Topic[Any]) -> Endpoint:
    """Return the endpoint that a remote publisher's token describes.

    Raises:
        MalformedMessage: its QoS is not valid.
    """
    qos = as_qos(from_text(token.qos), most_depth=_MOST_DEPTH)
    origin = f"{token.node_name} (another process)"
    return Endpoint(token.node_name, topic.name, topic.type, qos, origin, topic.name, remote=True)
