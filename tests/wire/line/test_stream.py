"""Stream: packets through a socket that gives and takes any number of bytes at a time."""

import socket
from collections.abc import Iterator
from itertools import count

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import MalformedMessage
from busflow.wire.line.packets import MOST_BYTES
from busflow.wire.line.stream import PacketStream


class Pair:
    """Two ends of a stream."""

    def __init__(self) -> None:
        self.own, self.other = socket.socketpair(socket.AF_UNIX, socket.SOCK_STREAM)
        self.own.setblocking(False)
        self.other.setblocking(False)
        self.rests: list[bool] = []
        self.stream = PacketStream(self.own, lambda: self.rests.append(True))

    def close(self) -> None:
        self.own.close()
        self.other.close()


@pytest.fixture
def pair() -> Iterator[Pair]:
    made = Pair()
    yield made
    made.close()


@pytest.mark.hypothesis
@given(st.lists(st.binary(min_size=1, max_size=3000), max_size=30), st.integers(1, 4000))
def test_packets_come_out_whole_however_the_bytes_are_cut(packets, size):
    pair = Pair()
    for packet in packets:
        pair.stream.send(packet)
    data, found = pair.other.recv(1 << 20) if packets else b"", list[bytes]()
    back = PacketStream(pair.own, print)
    for at in range(0, len(data), size):
        pair.other.send(data[at : at + size])
        try:
            while True:
                found.append(back.recv(MOST_BYTES))
        except BlockingIOError:
            pass
    pair.close()
    assert found == packets


def test_the_rest_of_a_packet_leaves_before_the_next_one(pair: Pair):
    sent = list[bytes]()
    for number in count():
        packet = bytes([number % 256]) * 60_000
        try:
            pair.stream.send(packet)
        except BlockingIOError:
            break
        sent.append(packet)
    assert pair.rests
    back, found = PacketStream(pair.other, print), list[bytes]()
    while len(found) < len(sent):
        try:
            found.append(back.recv(MOST_BYTES))
        except BlockingIOError:
            pair.stream.flush()
    assert found == sent


def test_a_closed_stream_has_no_packet(pair: Pair):
    pair.other.close()
    assert pair.stream.recv(MOST_BYTES) == b""


@pytest.mark.parametrize("size", [0, MOST_BYTES, 2**32 - 1])
def test_a_size_that_no_packet_has_is_refused(pair: Pair, size: int):
    pair.other.send(size.to_bytes(4, "little"))
    with pytest.raises(MalformedMessage):
        pair.stream.recv(MOST_BYTES)
