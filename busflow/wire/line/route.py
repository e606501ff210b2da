"""Route: the sender's state for one topic and one reader. It reads no clock, and does no I/O of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from enum import StrEnum  # whose members have a quick hash
from itertools import islice
from typing import Protocol, cast

from busflow.bus.qos import Overflow
from busflow.errors import MalformedMessage
from busflow.wire.line import packets
from busflow.wire.line.arena import Stored
from busflow.wire.line.packets import MOST_TOGETHER, SMALL, Kind, Reason, Wanted
from busflow.wire.zenoh.keys import ATTACHMENT_BYTES, GID_AT, SEQUENCE
from busflow.wire.zenoh.sender import LARGE

CLOSE_NS = 100_000
"""A message that is published within this time of the one before waits for the end of the loop's turn."""
_MOST_WAITING = 64 << 20
"""Limit of the messages that wait for one reader, in bytes; a larger one waits alone."""

Waiting = tuple[bytes | Stored, bytes]
"""A message that waits: its payload, and its attachment."""


class RouteState(StrEnum):
    """What happens to the next message."""

    READY = "it leaves at once"
    GATHERING = "it leaves with others at the end of the loop's turn"
    WAITING = "it waits for a credit or for room in the socket, and the queue may drop it or another one"
    ENDED = "it goes nowhere"


class RouteEvent(StrEnum):
    """What changes a route's state."""

    FOLLOWED = "a small message came close behind the one before"
    REFUSED = "what waits cannot leave now"
    SENT = "all that waited has left"
    ENDED = "the reader wants no more, or has gone"


NEXT: Mapping[RouteState, Mapping[RouteEvent, RouteState]] = {
    RouteState.READY: {
        RouteEvent.FOLLOWED: RouteState.GATHERING,
        RouteEvent.REFUSED: RouteState.WAITING,
        RouteEvent.SENT: RouteState.READY,
        RouteEvent.ENDED: RouteState.ENDED,
    },
    RouteState.GATHERING: {
        RouteEvent.REFUSED: RouteState.WAITING,
        RouteEvent.SENT: RouteState.READY,
        RouteEvent.ENDED: RouteState.ENDED,
    },
    RouteState.WAITING: {
        RouteEvent.REFUSED: RouteState.WAITING,
        RouteEvent.SENT: RouteState.READY,
        RouteEvent.ENDED: RouteState.ENDED,
    },
    RouteState.ENDED: {RouteEvent.ENDED: RouteState.ENDED},
}
"""The states of a route, and what follows on which event."""


_READY = RouteState.READY
_NOTHING = bytes(ATTACHMENT_BYTES)
"""The attachment before a publisher's first one."""


class Carrier(Protocol):
    """The line that a route belongs to."""

    @property
    def transmit(self) -> Callable[[bytes], object]:
        """A function that hands a packet to the kernel, or raises BlockingIOError if that has no room."""
        ...

    def transmit_piece(self, packet: bytes, stored: Stored, /) -> object:
        """Do the same with the place of a message, which the reader can read from then on."""
        ...

    def wait_for_room(self, route: Route, /) -> None:
        """Call the route's `flush` as soon as the kernel has room."""
        ...

    def fail(self, error: OSError, /) -> None:
        """End the line soon: a packet could not be sent."""
        ...

    @property
    def call_soon(self) -> Callable[[Callable[[], None]], object]:
        """A function that calls another one at the end of the loop's turn."""
        ...


class Route:
    """Sends a topic's messages to one reader, in their order, no more than it can keep."""

    def __init__(self, number: int, key: str, session: str, wanted: Wanted, carrier: Carrier) -> None:
        """Create a route.

        Args:
            number: its number, chosen by the reader.
            key: the topic's key.
            session: the id of the reader's session.
            wanted: the depth and overflow of the reader's deepest queue.
            carrier: the line.
        """
        self.key: str = key
        self.session: str = session
        self.state: RouteState = RouteState.READY
        self.sent: int = 0
        """Number of messages that have left."""
        self.dropped: int = 0
        """Number of messages that were dropped, since the reader was behind by more than its queue."""
        self._number, self._carrier, self._transmit = number, carrier, carrier.transmit
        self._prefix = packets.head(Kind.MESSAGE, number)
        self._unacknowledged = deque[Stored | None]()
        """By packet that the reader has not acknowledged, its message in shared memory."""
        self._pieces = 0
        """Number of these messages."""
        self._waiting = deque[Waiting]()
        self._bytes = 0
        self._begun = 0
        """How many bytes of the first waiting message have left in parts."""
        self._tails: dict[bytes, bytes] = {}
        """By publisher whose last message was dropped, its attachment."""
        self._last_ns = 0
        self.change(wanted)

    @property
    def has_ended(self) -> bool:
        """Whether the reader wants no more, or has gone."""
        return self.state is RouteState.ENDED

    @property
    def waiting(self) -> int:
        """Number of messages that wait for the reader."""
        return len(self._waiting)

    @property
    def unacknowledged(self) -> int:
        """Number of packets that the reader has not acknowledged."""
        return len(self._unacknowledged)

    def change(self, wanted: Wanted) -> None:
        """Keep as much as another queue can keep."""
        self._wanted = wanted
        self._window, self._most_pieces = wanted.window, wanted.pieces
        if self.state is RouteState.WAITING:
            self.flush()

    def send(self, payload: bytes | Stored, attachment: bytes, now_ns: int) -> None:
        """Send a message now, at the end of the loop's turn, or when the reader has room.

        It becomes a holder of a stored message.
        """
        follows = now_ns - self._last_ns <= CLOSE_NS
        self._last_ns = now_ns
        state, size = self.state, len(payload)
        if state is _READY and not follows and size <= LARGE and isinstance(payload, bytes):
            if self._sends_alone(payload, attachment):
                return
        elif state is RouteState.ENDED:
            return
        if isinstance(payload, Stored):
            payload.hold()
        waiting = self._waiting
        waiting.append((payload, attachment))
        self._bytes += size
        if state is RouteState.WAITING:
            self._drop_beyond_depth()
        elif not follows or size > SMALL or len(waiting) >= MOST_TOGETHER:
            self.flush()
        elif state is _READY:
            self._step(RouteEvent.FOLLOWED)
            self._carrier.call_soon(self._end_turn)

    def _sends_alone(self, payload: bytes, attachment: bytes) -> bool:
        """Send a message that waits for nothing; return False if it has to wait."""
        if len(self._unacknowledged) >= self._window:
            return False
        try:
            self._transmit(self._prefix + attachment + payload)
        except BlockingIOError:
            return False
        except OSError as error:
            self._carrier.fail(error)
            return True
        self._unacknowledged.append(None)
        self.sent += 1
        return True

    def _end_turn(self) -> None:
        if self.state is RouteState.GATHERING:
            self.flush()

    def flush(self) -> None:
        """Send what waits, as far as the reader and the socket have room."""
        if self.state is RouteState.ENDED:
            return
        try:
            while self._waiting and self._has_credit():
                self._send_next()
            if not self._waiting:
                self._send_marks(Reason.OVERFLOW)
        except BlockingIOError:
            self._carrier.wait_for_room(self)
        except OSError as error:
            self._carrier.fail(error)
        if self._waiting or self._tails:
            self._step(RouteEvent.REFUSED)
            self._drop_beyond_depth()
        else:
            self._step(RouteEvent.SENT)

    def _send_marks(self, reason: Reason) -> None:
        """Say which publishers' last messages were dropped, which no gap before a later message shows.

        Raises:
            BlockingIOError: The socket has no room for all of it.
        """
        while self._tails:
            gid, attachment = next(iter(self._tails.items()))
            self._transmit(packets.packed(Kind.MARK, self._number, attachment, reason))
            self._unacknowledged.append(None)
            self._tails.pop(gid, None)

    def give_up(self) -> None:
        """Drop what waits, and say so if the socket has room: the sender ends.

        What had overflowed before it, and behind it, is told apart.
        """
        begun = 1 if self._begun else 0
        behind, self._tails = self._tails, {}
        for _, attachment in reversed([*islice(self._waiting, begun, None)]):
            self._tails[attachment[GID_AT:ATTACHMENT_BYTES]] = _before(attachment)
        self._send_last_marks(Reason.OVERFLOW)
        while len(self._waiting) > begun:
            self._drop(begun)
        self._send_last_marks(Reason.END)
        self._tails = behind
        self._send_last_marks(Reason.OVERFLOW)

    def _send_last_marks(self, reason: Reason) -> None:
        """Send marks if the socket has room, and forget them; none may come into a message that has left in part."""
        if not self._begun:
            with suppress(OSError):
                self._send_marks(reason)
        self._tails = {}

    def acknowledge(self, count: int) -> None:
        """Note that the reader has done with so many packets, the oldest first.

        Raises:
            MalformedMessage: There are not so many.
        """
        if count > len(self._unacknowledged):
            raise MalformedMessage(f"{count} packets are acknowledged, but {len(self._unacknowledged)} were sent")
        for _ in range(count):
            if (stored := self._unacknowledged.popleft()) is not None:
                self._pieces -= 1
                stored.release()
        if self.state is RouteState.WAITING:
            self.flush()

    def end(self) -> bool:
        """End the route; return whether its reader may still read messages in shared memory."""
        may_read = self._pieces > 0
        self._step(RouteEvent.ENDED)
        for stored in (*self._unacknowledged, *(payload for payload, _ in self._waiting)):
            if isinstance(stored, Stored):
                stored.release()
        self._unacknowledged.clear()
        self._waiting.clear()
        self._tails.clear()
        self._pieces = self._bytes = self._begun = 0
        return may_read

    def _has_credit(self) -> bool:
        if len(self._unacknowledged) >= self._window:
            return False
        return self._pieces < self._most_pieces or not isinstance(self._waiting[0][0], Stored)

    def _send_next(self) -> None:
        """Send the next packet out of the messages that wait."""
        payload, attachment = self._waiting[0]
        count, stored = 1, None
        if isinstance(payload, Stored):
            packet = packets.packed(Kind.PIECE, self._number, attachment, payload.offset, payload.size)
            self._carrier.transmit_piece(packet, payload)
            stored = payload
            self._pieces += 1
        elif (rest := len(payload) - self._begun) > LARGE:
            part = payload[self._begun : self._begun + LARGE]
            self._transmit(packets.head(Kind.PART, self._number) + part)
            self._begun += LARGE
            count = 0
        else:
            small = self._small_ones() if rest <= SMALL and not self._begun else []
            if len(small) > 1:
                self._transmit(packets.burst(self._number, small))
                count = len(small)
            else:
                self._transmit(self._prefix + attachment + payload[self._begun :])
        self._unacknowledged.append(stored)
        self._note_sent(count)

    def _small_ones(self) -> list[packets.Signed]:
        """Return the messages that may leave as one packet: the small ones at the front."""
        found = list(islice(self._waiting, MOST_TOGETHER))
        for at, (payload, _) in enumerate(found):
            if len(payload) > SMALL or isinstance(payload, Stored):
                del found[at:]
                break
        return cast("list[packets.Signed]", found)

    def _note_sent(self, count: int) -> None:
        for _ in range(count):
            payload, attachment = self._waiting.popleft()
            self._bytes -= len(payload)
            if self._tails:
                gid = attachment[GID_AT:ATTACHMENT_BYTES]
                if gid in self._tails and _sequence(attachment) > _sequence(self._tails[gid]):
                    del self._tails[gid]
        self.sent += count
        if count:
            self._begun = 0

    def _drop_beyond_depth(self) -> None:
        """Drop as many waiting messages as the reader's queue would have dropped; never one that has left in part."""
        begun = 1 if self._begun else 0
        while (left := len(self._waiting) - begun) > self._wanted.depth or (left > 1 and self._bytes > _MOST_WAITING):
            self._drop(begun if self._wanted.overflow is Overflow.DROP_OLDEST else len(self._waiting) - 1)

    def _drop(self, at: int) -> None:
        payload, attachment = self._waiting[at]
        del self._waiting[at]
        self._bytes -= len(payload)
        self.dropped += 1
        if isinstance(payload, Stored):
            payload.release()
        gid = attachment[GID_AT:ATTACHMENT_BYTES]
        behind = islice(self._waiting, at, None) if at < len(self._waiting) else ()
        is_last = all(each[GID_AT:ATTACHMENT_BYTES] != gid for _, each in behind)
        if is_last and _sequence(attachment) > _sequence(self._tails.get(gid, _NOTHING)):
            self._tails[gid] = attachment

    def _step(self, event: RouteEvent) -> None:
        self.state = NEXT[self.state][event]


def _before(attachment: bytes) -> bytes:
    """Return the attachment of the same publisher's message before; number 0 is that of no message."""
    return SEQUENCE.pack(_sequence(attachment) - 1) + attachment[SEQUENCE.size :]


def _sequence(attachment: bytes) -> int:
    return SEQUENCE.unpack_from(attachment)[0]
