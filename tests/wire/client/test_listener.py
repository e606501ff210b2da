"""What waits at a process that looks: in order, within bounds, and with what was missed counted."""

import threading
from types import SimpleNamespace

import pytest

from busflow.wire.client.listener import MOST_BYTES, Listener
from busflow.wire.zenoh.keys import Attachment

GID, OTHER = bytes(16), bytes(range(16))


class Raw:
    def __init__(self, data):
        self.data = data

    def to_bytes(self):
        return self.data


def sample(sequence=None, payload=b"x", gid=GID, attachment=None):
    """What Zenoh hands over, as far as a listener looks at it."""
    if sequence is not None:
        attachment = Attachment(sequence, 5, gid).encode()
    return SimpleNamespace(payload=Raw(payload), attachment=None if attachment is None else Raw(attachment))


def test_messages_come_in_order_with_sender_and_time():
    listener = Listener(10)
    for sequence in (1, 2):
        listener.put(sample(sequence))
    assert [(each.sequence, each.stamp_ns, each.gid) for each in (listener.get(), listener.get())] == [
        (1, 5, GID),
        (2, 5, GID),
    ]
    assert listener.get(0) is None


def test_waiting_for_a_message_ends_when_it_comes():
    listener = Listener(10)
    threading.Timer(0.02, listener.put, [sample(1)]).start()
    assert listener.get(60).sequence == 1


def test_gaps_are_losses_and_overflows_are_drops():
    listener = Listener(2)
    for sequence, gid in ((5, GID), (6, GID), (9, GID), (2**62, GID), (1, OTHER), (2, OTHER), (1, GID)):
        listener.put(sample(sequence, gid=gid))
    assert (listener.lost, listener.dropped) == (2, 5)
    assert [listener.get(0).sequence for _ in range(2)] == [2, 1]


def test_the_listeners_queue_is_bounded_in_bytes():
    listener = Listener(100)
    third = bytes(MOST_BYTES // 3)
    for sequence in range(1, 5):
        listener.put(sample(sequence, third))
    assert listener.dropped == 1
    listener.put(sample(5, bytes(MOST_BYTES + 1)))
    assert (listener.dropped, listener.get(0).sequence) == (4, 5)


@pytest.mark.parametrize("attachment", [None, b"", b"\0" * 33, b"x" * 32])
def test_message_signed_otherwise_is_still_received(attachment):
    listener = Listener(2)
    listener.put(sample(attachment=attachment))
    listener.put(sample(attachment=attachment))
    received = listener.get(0)
    assert (received.payload, received.sequence, received.gid) == (b"x", 0, b"")
    assert listener.lost == 0
