"""What has arrived on a topic, by lines and through Zenoh, in its order."""

from math import inf

import zenoh

from busflow.wire.line.packets import Reason
from busflow.wire.mirror.arrival_buffer import ArrivalBuffer
from busflow.wire.zenoh.keys import Attachment
from busflow.wire.zenoh.sender import LARGE

GID, OTHER = b"g" * 16, b"h" * 16
MESSAGES = [(bytes([number]) * number, Attachment(number, 7, GID).encode()) for number in range(1, 6)]


class Sender:
    """An intake that notes what is acknowledged."""

    def __init__(self):
        self.done = []

    def acknowledge(self, count):
        self.done.append(count)


def test_batch_ends_with_its_first_large_message():
    alone = [MESSAGES[0], (bytes(LARGE), MESSAGES[1][1]), MESSAGES[2], (b"", MESSAGES[3][1])]
    buffer = ArrivalBuffer(inf)
    buffer.put(alone, None)
    assert len(buffer) == 4
    assert [buffer.take(), buffer.take(1), buffer.take(), buffer.take()] == [alone[:2], alone[2:3], alone[3:], []]


def test_messages_of_all_ways_keep_their_order_and_are_acknowledged_together():
    sender, other = Sender(), (b"x", Attachment(1, 7, OTHER).encode())
    buffer = ArrivalBuffer(inf)
    buffer.put(MESSAGES[:2], sender)
    buffer.put([other], None)
    buffer.put(MESSAGES[2:4], sender)
    assert buffer.take(3) == [*MESSAGES[:2], other]
    assert buffer.take(1) == [MESSAGES[2]]
    assert sender.done == []
    buffer.acknowledge()
    buffer.acknowledge()
    assert sender.done == [3]
    assert buffer.take() == [MESSAGES[3]]
    buffer.acknowledge()
    assert sender.done == [3, 1]


def test_messages_are_skipped_oldest_first_up_to_what_has_to_be_seen():
    sender = Sender()
    buffer = ArrivalBuffer(inf)
    buffer.put(MESSAGES[:3], sender)
    buffer.put([MESSAGES[3], (b"", b"x" * 33)], None)
    signatures = [attachment for _, attachment in MESSAGES]
    assert buffer.skip(4, {GID}) == signatures[:1]
    assert buffer.skip(4, {GID}) == []
    assert buffer.skip(1, {GID}) == signatures[1:4]
    assert buffer.skip(0, {GID}) == [], "its publisher is unknown"
    assert buffer.take() == [(b"", b"x" * 33)]
    buffer.put([(Reason.OVERFLOW, signatures[4])], sender)
    assert buffer.skip(0, {GID}) == []
    assert buffer.take() == [(Reason.OVERFLOW, signatures[4])]
    buffer.acknowledge()
    assert sender.done == [4]


def test_messages_of_a_closed_intake_are_gone():
    sender, other = Sender(), Sender()
    buffer = ArrivalBuffer(inf)
    buffer.put(MESSAGES[:2], sender)
    buffer.put(MESSAGES[2:3], other)
    buffer.put(MESSAGES[3:4], None)
    buffer.put(MESSAGES[4:], sender)
    buffer.discard(sender)
    assert buffer.take() == MESSAGES[2:4]
    buffer.acknowledge()
    assert (sender.done, other.done) == ([], [1])


def test_buffer_copies_nothing_too_large_for_its_type():
    buffer = ArrivalBuffer(12)
    buffer.put([(zenoh.ZBytes(bytes(size)), MESSAGES[0][1]) for size in (12, 13)], None)
    (small, _), (large, _) = buffer.take(9)
    assert isinstance(small, bytes)
    assert isinstance(large, zenoh.ZBytes)
