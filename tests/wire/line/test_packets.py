"""Packets: what is written is read, and anything else is refused."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.bus.qos import Overflow
from busflow.errors import MalformedMessage
from busflow.wire.line import packets
from busflow.wire.line.packets import Kind, Reason, Wanted

pytestmark = pytest.mark.hypothesis

numbers = st.integers(0, 2**32 - 1)
attachments = st.binary(min_size=33, max_size=33)
wishes = st.builds(Wanted, st.integers(1, 2**32 - 1), st.sampled_from([Overflow.DROP_OLDEST, Overflow.DROP_NEWEST]))
READERS = (
    packets.read_hello,
    packets.read_wanted,
    packets.read_credit,
    packets.read_burst,
    packets.read_piece,
    packets.read_arena,
    packets.read_mark,
    packets.number_of,
)


@given(numbers, st.text(), wishes)
def test_a_wish_is_read_as_it_was_written(number, key, wanted):
    assert packets.read_wanted(packets.opened(number, key, wanted)) == (number, wanted, key)
    assert packets.read_wanted(packets.changed(number, wanted)) == (number, wanted, "")


@given(numbers, st.lists(st.tuples(st.binary(max_size=packets.SMALL), attachments), min_size=1, max_size=32))
def test_a_burst_is_its_messages(number, messages):
    data = packets.burst(number, messages)
    assert data[0] == Kind.BURST
    assert packets.number_of(data) == number
    assert packets.read_burst(data) == messages
    assert len(data) <= packets.MOST_BYTES


@given(numbers, attachments, st.integers(0, 2**63), st.integers(0, 2**63))
def test_a_place_and_a_mark_are_read_as_they_were_written(number, attachment, offset, size):
    assert packets.read_piece(packets.piece(number, attachment, offset, size)) == (attachment, offset, size)
    for reason in Reason:
        assert packets.read_mark(packets.mark(number, attachment, reason)) == (reason, attachment)


@given(numbers, numbers, st.integers(0, 2**63))
def test_credits_and_memory_are_read_as_they_were_written(number, count, size):
    assert packets.read_credit(packets.credit(number, count)) == (number, count)
    assert packets.read_arena(packets.arena(size)) == size
    assert packets.read_hello(packets.hello(f"{number:x}")) == f"{number:x}"


@given(st.sampled_from(READERS), st.binary(min_size=1, max_size=300))
def test_other_bytes_are_refused_as_malformed(reader, data):
    with suppress(MalformedMessage):
        reader(data)


@pytest.mark.parametrize(
    ("reader", "whole"),
    [
        (packets.read_credit, packets.credit(1, 2)),
        (packets.read_piece, packets.piece(1, bytes(33), 0, 9)),
        (packets.read_arena, packets.arena(9)),
        (packets.read_mark, packets.mark(1, bytes(33), Reason.END)),
        (packets.read_burst, packets.burst(1, [(b"a", bytes(33))])),
    ],
)
def test_a_packet_with_a_byte_too_many_or_too_few_is_refused(reader, whole):
    for data in (whole + b"x", whole[:-1]):
        with pytest.raises(MalformedMessage):
            reader(data)


def test_a_reason_that_nobody_knows_is_refused():
    with pytest.raises(MalformedMessage):
        packets.read_mark(packets.mark(1, bytes(33), Reason.END)[:-1] + b"\x09")


def test_another_version_is_refused():
    with pytest.raises(MalformedMessage):
        packets.read_hello(bytes((Kind.HELLO, packets.VERSION + 1)) + b"ab")
