"""Packets: what is written is read, and anything else is refused."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.bus.qos import Overflow
from busflow.wire.line import packets
from busflow.wire.line.packets import Kind, Reason, Wanted

pytestmark = pytest.mark.hypothesis

numbers = st.integers(0, 2**32 - 1)
attachments = st.binary(min_size=33, max_size=33)
wishes = st.builds(Wanted, st.integers(1, 2**32 - 1), st.sampled_from([Overflow.DROP_OLDEST, Overflow.DROP_NEWEST]))
READERS = (packets.read_hello, packets.read_opened, packets.read_burst, packets.values_of, packets.number_of)


@given(numbers, st.text(), wishes)
def test_a_wish_is_read_as_it_was_written(number, key, wanted):
    assert packets.read_opened(packets.opened(number, key, wanted)) == (number, key, wanted)


@given(numbers, st.lists(st.tuples(st.binary(max_size=packets.SMALL), attachments), min_size=1, max_size=32))
def test_a_burst_is_its_messages(number, messages):
    data = packets.burst(number, messages)
    assert data[0] == Kind.BURST
    assert packets.number_of(data) == number
    assert packets.read_burst(data) == messages
    assert len(data) <= packets.MOST_BYTES


@given(numbers, attachments, st.integers(0, 2**63), st.integers(0, 2**63))
def test_packets_of_a_fixed_form_are_read_as_they_were_written(number, attachment, offset, size):
    for kind, *values in (
        (Kind.PIECE, number, attachment, offset, size),
        (Kind.MARK, number, attachment, Reason.END),
        (Kind.CREDIT, number, number),
        (Kind.ARENA, size),
    ):
        data = packets.packed(kind, *values)
        assert (data[0], *packets.values_of(data)) == (kind, *values)
        for other in (data + b"x", data[:-1]):
            with pytest.raises(packets.NO_PACKET):
                packets.values_of(other)
    assert packets.read_hello(packets.hello(f"{number:x}")) == f"{number:x}"


@given(st.sampled_from(READERS), st.binary(min_size=1, max_size=300))
def test_other_bytes_are_refused_as_no_packet(reader, data):
    with suppress(*packets.NO_PACKET):
        reader(data)


def test_a_burst_with_a_byte_too_many_or_too_few_is_refused():
    whole = packets.burst(1, [(b"a", bytes(33))])
    for data in (whole + b"x", whole[:-1]):
        with pytest.raises(packets.NO_PACKET):
            packets.read_burst(data)


def test_another_version_is_refused():
    with pytest.raises(packets.NO_PACKET):
        packets.read_hello(bytes((Kind.HELLO, packets.VERSION + 1)) + b"ab")
