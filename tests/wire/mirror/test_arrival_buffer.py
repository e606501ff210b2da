"""What has arrived on a topic, by lines and through Zenoh, in its order and within limits."""

from collections import deque
from math import inf
from types import SimpleNamespace

import zenoh

from busflow.wire.line.packets import Reason
from busflow.wire.mirror import arrival_buffer
from busflow.wire.mirror.arrival_buffer import ArrivalBuffer
from busflow.wire.zenoh.keys import Attachment
from busflow.wire.zenoh.sender import LARGE

GID, OTHER = b"g" * 16, b"h" * 16
MESSAGES = [(bytes([number]) * number, Attachment(number, 7, GID).encode()) for number in range(1, 6)]


class Sender:
    """An intake that notes what is acknowledged."""

    def __init__(self):
        self.done = 0

    def acknowledge(self, count):
        self.done += count


def buffered(samples, depth, most_bytes=inf, *, by_line=(), heard=print):
    """A buffer whose ring has these samples; it says when it becomes too heavy."""
    buffer = ArrivalBuffer(depth, most_bytes, by_line=by_line, on_heavy=lambda: heard("heavy"))
    buffer.ring = SimpleNamespace(try_recv=lambda: samples.popleft() if samples else None)
    return buffer


def sample(payload, attachment=None):
    signature = None if attachment is None else zenoh.ZBytes(attachment)
    return SimpleNamespace(payload=zenoh.ZBytes(payload), attachment=signature)


def test_batch_ends_with_its_first_large_message():
    alone = [MESSAGES[0], (bytes(LARGE), MESSAGES[1][1]), MESSAGES[2], (b"", MESSAGES[3][1])]
    buffer = buffered(deque([sample(*each) for each in alone]), 16)
    buffer.fill()
    assert len(buffer) == 4
    assert [buffer.take(), buffer.take(1), buffer.take(), buffer.take()] == [alone[:2], alone[2:3], alone[3:], []]


def test_both_ways_keep_their_order_and_none_comes_twice():
    sender, other = Sender(), (b"x", Attachment(1, 7, OTHER).encode())
    buffer = buffered(deque([sample(*MESSAGES[0]), sample(*other), sample(*MESSAGES[1])]), 16, by_line={GID})
    buffer.put(MESSAGES[:2], sender)
    buffer.fill()
    buffer.put(MESSAGES[2:3], sender)
    assert buffer.take() == [*MESSAGES[:2], other, MESSAGES[2]]
    assert sender.done == 3
    assert buffer.take() == []
    assert sender.done == 3


def test_messages_are_skipped_oldest_first_up_to_what_has_to_be_seen():
    sender = Sender()
    buffer = buffered(deque([sample(*MESSAGES[3]), sample(b"", b"x" * 33)]), 16)
    buffer.put(MESSAGES[:3], sender)
    buffer.fill()
    signatures = [attachment for _, attachment in MESSAGES]
    assert buffer.skip(4, {GID}) == signatures[:1]
    assert buffer.skip(4, {GID}) == []
    assert buffer.skip(1, {GID}) == signatures[1:4]
    assert buffer.skip(0, {GID}) == [], "its publisher is unknown"
    assert buffer.take() == [(b"", b"x" * 33)]
    buffer.put([(Reason.OVERFLOW, signatures[4])], sender)
    assert buffer.skip(0, {GID}) == []
    assert buffer.take() == [(Reason.OVERFLOW, signatures[4])]
    assert sender.done == 4


def test_messages_of_a_closed_intake_are_gone():
    sender, other = Sender(), Sender()
    buffer = buffered(deque([sample(*MESSAGES[3])]), 16)
    buffer.put(MESSAGES[:2], sender)
    buffer.put(MESSAGES[2:3], other)
    buffer.fill()
    buffer.put(MESSAGES[4:], sender)
    buffer.discard(sender)
    assert buffer.take() == MESSAGES[2:4]
    assert (sender.done, other.done) == (0, 1)


def test_buffer_keeps_newest_samples_within_its_limits(monkeypatch):
    monkeypatch.setattr(arrival_buffer, "LARGEST", 4000)
    ring, heavy, sender = deque[SimpleNamespace](), [], Sender()
    samples = [sample(bytes([n]) * 1000) for n in range(8)]
    buffer = buffered(ring, 6, heard=heavy.append)

    def numbers():
        return [payload[0] for payload, _ in buffer.take(inf)]

    ring.extend(samples[:4])
    buffer.limit()
    assert (numbers(), buffer.has_dropped) == ([0, 1, 2, 3], False)
    buffer.put([(b"\7", MESSAGES[0][1])], sender)
    ring.extend(samples[:5])
    buffer.limit()
    assert (numbers(), buffer.has_dropped, heavy) == ([1, 2, 3, 4], True, ["heavy"])
    assert sender.done == 1
    ring.append(samples[0])
    buffer.limit()
    assert (numbers(), buffer.has_dropped) == ([0], False)
    ring.extend([*samples[:2], sample(bytes(5000))])
    buffer.limit()
    assert ([len(payload) for payload, _ in buffer.take()], heavy) == ([5000], ["heavy"]), "one stays; it says so once"
    ring.extend([sample(b"x")] * 9)
    buffer.fill()
    assert len(buffer.take(1)) == len(buffer) - 4 == 1
    assert buffer.has_dropped
    ring.extend([sample(b"x")] * 6)
    buffer.fill()
    assert (len(buffer.take()), buffer.has_dropped) == (6, True)


def test_buffer_copies_nothing_too_large_for_its_type():
    buffer = buffered(deque([sample(bytes(size)) for size in (12, 13)]), 6, 12)
    buffer.fill()
    (small, _), (large, _) = buffer.take(9)
    assert isinstance(small, bytes)
    assert isinstance(large, zenoh.ZBytes)
