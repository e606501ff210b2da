"""Intake: the receiver's state for one topic and one sender. It reads no clock, and does no I/O of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from enum import StrEnum  # whose members have a quick hash
from typing import Protocol

from busflow.errors import MalformedMessage
from busflow.wire.line import packets
from busflow.wire.line.arena import Piece
from busflow.wire.line.packets import Reason, Wanted
from busflow.wire.zenoh.sender import LARGEST

Arrived = tuple[bytes | Piece | Reason, bytes]
"""A message that has arrived: its payload and its attachment.

A reason in place of the payload means that the publisher's messages up to this number were dropped for it.
"""


class IntakeState(StrEnum):
    """What an intake has of the next message."""

    WHOLE = "nothing"
    PARTIAL = "its beginning"
    ENDED = "nothing, and none comes"


class IntakeEvent(StrEnum):
    """What changes an intake's state."""

    PART = "a part of a message has come"
    MESSAGE = "one message, or its end, has come"
    OTHER = "messages of another form have come, which have no parts"
    END = "the sender has gone, or the receiver wants no more"


NEXT: Mapping[IntakeState, Mapping[IntakeEvent, IntakeState]] = {
    IntakeState.WHOLE: {
        IntakeEvent.PART: IntakeState.PARTIAL,
        IntakeEvent.MESSAGE: IntakeState.WHOLE,
        IntakeEvent.OTHER: IntakeState.WHOLE,
        IntakeEvent.END: IntakeState.ENDED,
    },
    IntakeState.PARTIAL: {
        IntakeEvent.PART: IntakeState.PARTIAL,
        IntakeEvent.MESSAGE: IntakeState.WHOLE,
        IntakeEvent.END: IntakeState.ENDED,
    },
    IntakeState.ENDED: {IntakeEvent.END: IntakeState.ENDED},
}
"""The states of an intake, and what follows on which event. Another event is a fault of the sender."""
_WHOLE = IntakeState.WHOLE


class Line(Protocol):
    """The line that an intake belongs to."""

    def tell(self, packet: bytes, /) -> None:
        """Send a packet in its order, as soon as the kernel has room."""
        ...

    def forget(self, number: int, /) -> None:
        """Forget an intake, which is closed."""
        ...

    @property
    def filled(self) -> list[Intake]:
        """The intakes that have messages to hand over."""
        ...


class Intake:
    """Receives a topic's messages from one sender, and acknowledges them."""

    def __init__(
        self,
        number: int,
        wanted: Wanted,
        take: Callable[[Sequence[Arrived]], None],
        on_end: Callable[[], None],
        line: Line,
    ) -> None:
        """Create an intake.

        Args:
            number: the number of the route.
            wanted: the depth and overflow of the deepest queue behind it.
            take: called with the messages that have arrived, the oldest first.
            on_end: called once, after the last message, when the sender has gone or the line is broken.
            line: the line that it belongs to.
        """
        self.state: IntakeState = IntakeState.WHOLE
        self._number, self._line, self._wanted = number, line, wanted
        self._filled = line.filled
        self._take, self._on_end = take, on_end
        self._arrived: list[Arrived] = []
        self._parts: list[bytes] = []
        self._size = 0
        self._packets = deque[tuple[int, bool]]()
        """By packet that is not acknowledged: its messages, and whether its sender waits for just this one."""
        self._done = 0
        """Number of messages of the oldest packet that are acknowledged."""
        self._due, self._is_urgent = 0, False
        """Number of packets to acknowledge, and whether that is to happen now."""

    # What the line calls.

    def add(self, payload: bytes, attachment: bytes) -> None:
        """Add a message, or the end of one."""
        if self.state is not _WHOLE:
            self._step(IntakeEvent.MESSAGE)
            payload = b"".join((*self._parts, payload))
            self._parts, self._size = [], 0
        if not self._arrived:
            self._filled.append(self)
        self._arrived.append((payload, attachment))
        self._packets.append((1, False))

    def add_part(self, part: bytes) -> None:
        """Add the beginning of a message, or more of it.

        Raises:
            MalformedMessage: The message is too large.
        """
        self._step(IntakeEvent.PART)
        self._parts.append(part)
        self._size += len(part)
        if self._size > LARGEST:
            raise MalformedMessage(f"a message has more than {LARGEST:,} bytes")
        self._packets.append((0, True))
        self._acknowledge_parts()

    def add_all(self, messages: Sequence[Arrived], *, is_urgent: bool = False) -> None:
        """Add the messages of one packet."""
        if self.state is not _WHOLE:
            self._step(IntakeEvent.OTHER)
        if not self._arrived:
            self._filled.append(self)
        self._arrived += messages
        self._packets.append((len(messages), is_urgent))

    def hand_over(self) -> None:
        """Give the messages that have arrived to the receiver."""
        arrived, self._arrived = self._arrived, []
        self._take(arrived)

    def end(self) -> None:
        """Note that the sender has gone; the beginning of a message is dropped."""
        if self.state is not IntakeState.ENDED:
            self._step(IntakeEvent.END)
            self._parts.clear()
            self._on_end()

    # What the receiver calls.

    @property
    def holds_up(self) -> bool:
        """Whether its sender may send no more, and so keeps newer messages back, until some are acknowledged."""
        count, most_pieces = len(self._packets), self._wanted.pieces
        if count + self._due >= self._wanted.window:
            return True
        return count >= most_pieces and sum(is_urgent for _, is_urgent in self._packets) >= most_pieces

    def acknowledge(self, count: int) -> None:
        """Note that `count` messages more are done with, the oldest first; their sender may then send others."""
        self._done += count
        self._acknowledge_parts()

    def change(self, wanted: Wanted) -> None:
        """State another depth and overflow of the deepest queue."""
        if wanted != self._wanted and self.state is not IntakeState.ENDED:
            self._wanted = wanted
            self._line.tell(packets.opened(self._number, "", wanted))
            self._acknowledge_parts()  # a smaller window may be used up by what is due

    def close(self) -> None:
        """Receive no more. A message in shared memory that was not read yet must not be read any more."""
        if self.state is not IntakeState.ENDED:
            self._step(IntakeEvent.END)
            self._line.tell(packets.head(packets.Kind.CLOSE, self._number))
            self._line.forget(self._number)

    def _acknowledge_parts(self) -> None:
        """Find the packets of which every message is done with; parts of a message have none."""
        while self._packets and self._done >= self._packets[0][0]:
            messages, is_urgent = self._packets.popleft()
            self._done -= messages
            self._due += 1
            self._is_urgent |= is_urgent
        if self._due and (self._is_urgent or self._due >= self._wanted.window // 2):
            if self.state is not IntakeState.ENDED:
                self._line.tell(packets.packed(packets.Kind.CREDIT, self._number, self._due))
            self._due, self._is_urgent = 0, False

    def _step(self, event: IntakeEvent) -> None:
        """Change the state.

        Raises:
            MalformedMessage: The sender must not do this now.
        """
        if event not in NEXT[self.state]:
            raise MalformedMessage(f"a sender that has sent {self.state.value} of a message went on: {event.value}")
        self.state = NEXT[self.state][event]
