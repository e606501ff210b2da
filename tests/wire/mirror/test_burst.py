"""Small messages that follow each other closely: they cross as one, and nothing but the wire shows it."""

import asyncio
import os
import platform
import struct
import threading
from collections import deque
from contextlib import asynccontextmanager, contextmanager
from math import inf
from types import SimpleNamespace

import pytest
import zenoh

from busflow import Node, QoS, publisher, subscription
from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Int64, UInt8MultiArray
from busflow.wire.mirror import arrival_buffer
from busflow.wire.mirror.arrival_buffer import ArrivalBuffer
from busflow.wire.mirror.burst import MOST_BYTES, BurstSender, is_burst, joined, taken_apart
from busflow.wire.zenoh.keys import Attachment, Token, TokenKind, burst_key, topic_key
from busflow.wire.zenoh.qos_text import to_text
from busflow.wire.zenoh.sender import LARGE
from busflow.wire.zenoh.session import open_session
from tests.wire.mirror.processes import PATIENCE_S, Process, until

SHARED = pytest.mark.skipif(
    not hasattr(os, "memfd_create") or platform.machine() != "x86_64",
    reason="only processes that share memory send bursts",
)
MESSAGES = [(bytes([number]) * number, Attachment(number, 7, b"g" * 16).encode()) for number in range(1, 5)]


# The form.


def test_messages_come_apart_as_they_were_joined():
    payload, attachments = joined(MESSAGES)
    assert taken_apart(payload, attachments) == MESSAGES
    assert is_burst(attachments)
    assert not any(map(is_burst, [b"", MESSAGES[0][1], MESSAGES[0][1] + bytes(40)]))


@pytest.mark.parametrize(
    "change",
    [
        lambda payload, attachments: (payload[:-1], attachments),
        lambda payload, attachments: (payload + b"x", attachments),
        lambda payload, attachments: (payload[:7], attachments),
        lambda _payload, attachments: (b"", attachments),
        lambda payload, attachments: (payload, attachments + attachments),
        lambda payload, attachments: (struct.pack("<I", 2**32 - 1) + payload[4:], attachments),
        lambda _payload, attachments: (bytes(4 * 4 * 17), attachments * 17),
    ],
)
def test_bytes_that_are_no_burst_are_refused(change):
    with pytest.raises(MalformedMessage):
        taken_apart(*change(*joined(MESSAGES)))


# Arriving.


def buffered(samples, depth, most_bytes=inf, *, heard=print):
    """A buffer whose ring has these samples; it says what is malformed, and when it becomes too heavy."""
    ring = SimpleNamespace(try_recv=lambda: samples.popleft() if samples else None)
    return ArrivalBuffer(ring, depth, most_bytes, on_malformed=heard, on_heavy=lambda: heard("heavy"))


def sample(payload, attachment=None):
    signature = None if attachment is None else zenoh.ZBytes(attachment)
    return SimpleNamespace(payload=zenoh.ZBytes(payload), attachment=signature)


def test_batch_ends_with_its_first_large_message():
    alone = [MESSAGES[0], (bytes(LARGE), MESSAGES[1][1]), MESSAGES[2], (b"", MESSAGES[3][1]), MESSAGES[3]]
    buffer = buffered(deque([sample(*each) for each in (joined(MESSAGES), *alone)]), 16)
    buffer.fill()
    assert len(buffer) == 9
    taken = [buffer.take(3), buffer.take(), buffer.take(1), buffer.take(), buffer.take()]
    assert taken == [MESSAGES, alone[:2], alone[2:3], alone[3:], []]


def test_messages_are_skipped_oldest_first_and_bursts_whole():
    burst, alone = joined(MESSAGES[:3]), [sample(*each) for each in MESSAGES]
    buffer = buffered(deque([*alone[:2], sample(*burst), alone[3], sample(b"", b"x" * 33)]), 16)
    buffer.fill()
    signatures = [attachment for _, attachment in MESSAGES]
    assert buffer.skip(4, {b"g" * 16}) == signatures[:2]
    assert buffer.skip(3, {b"g" * 16}) == []
    assert buffer.skip(1, {b"g" * 16}) == signatures
    assert buffer.skip(0, {b"g" * 16}) == []
    assert buffer.take() == [(b"", b"x" * 33)]


def test_buffer_keeps_newest_samples_within_its_limits(monkeypatch):
    monkeypatch.setattr(arrival_buffer, "LARGEST", 4000)
    ring, heavy = deque[SimpleNamespace](), []
    samples = [sample(bytes([n]) * 1000) for n in range(8)]
    buffer = buffered(ring, 6, heard=heavy.append)

    def numbers():
        return [payload[0] for payload, _ in buffer.take(inf)]

    ring.extend(samples[:4])
    buffer.fill()
    assert (numbers(), buffer.has_dropped) == ([0, 1, 2, 3], False)
    ring.extend(samples[:5])
    buffer.fill()
    assert (numbers(), buffer.has_dropped, heavy) == ([1, 2, 3, 4], True, ["heavy"])
    ring.append(samples[0])
    buffer.fill()
    assert (numbers(), buffer.has_dropped) == ([0], False)
    ring.extend([*samples[:2], sample(bytes(5000))])
    buffer.fill()
    assert ([len(payload) for payload, _ in buffer.take()], heavy) == ([5000], ["heavy"]), "one stays; it says so once"
    ring.extend([sample(b"x")] * 9)
    buffer.fill()
    assert len(buffer.take(1)) == len(buffer) - 4 == 1
    assert buffer.has_dropped
    ring.extend([sample(b"x")] * 6)
    buffer.fill()
    assert (len(buffer.take()), buffer.has_dropped) == (6, True)


def test_buffer_copies_nothing_too_large_for_its_type():
    ring, faults = deque([sample(bytes(size)) for size in (12, 13)]), []
    buffer = buffered(ring, 6, 12, heard=faults.append)
    buffer.fill()
    (small, _), (large, _) = buffer.take(9)
    assert isinstance(small, bytes)
    assert isinstance(large, zenoh.ZBytes)
    ring.append(sample(bytes(MOST_BYTES + 1), bytes(66)))
    buffer.fill()
    assert buffer.take(9) == []
    assert f"{MOST_BYTES + 1:,} bytes" in str(faults)


# Sending.


class Sent:
    """What a sender sends, each message as the numbers of those in it."""

    def __init__(self, *, is_allowed=True):
        self.sent = []
        self.sender = BurstSender(
            lambda _payload, attachment: self.sent.append(Attachment.decode(attachment).sequence),
            lambda *burst: self.sent.append([Attachment.decode(each).sequence for _, each in taken_apart(*burst)]),
        )
        self.sender.is_allowed = is_allowed
        self._count = 0

    def send(self, *moments_us, size=8):
        for moment_us in moments_us:
            self._count += 1
            self.sender.send(bytes(size), Attachment(self._count, 0, b"g" * 16).encode(), moment_us * 1000 + 10**18)


@pytest.mark.asyncio
async def test_close_messages_leave_together_after_the_turn():
    made = Sent()
    made.send(0, 50, 120, 219)
    assert made.sent == [1], "the first one waits for nothing"
    await asyncio.sleep(0)
    assert made.sent == [1, [2, 3, 4]]
    made.send(400, 501, 520)
    assert made.sent[2:] == [5, 6]
    await asyncio.sleep(0)
    assert made.sent[2:] == [5, 6, 7], "a single one is no burst"


@pytest.mark.asyncio
async def test_order_stays_and_bursts_are_bounded():
    made = Sent()
    made.send(*[0] * 34)
    assert made.sent == [1, [*range(2, 34)]], "32 messages leave before the turn ends"
    made.send(1000)
    assert made.sent[2:] == [34, 35], "after a pause nothing is overtaken"
    made.send(1000, 1000, size=1536)
    made.send(1000, size=1537)
    assert made.sent[4:] == [[36, 37], 38]
    await asyncio.sleep(0)
    assert made.sent[6:] == []


@pytest.mark.asyncio
async def test_messages_go_alone_unless_all_receive_bursts():
    made = Sent(is_allowed=False)
    made.send(0, 0, 0)
    assert made.sent == [1, 2, 3]
    made.sender.is_allowed = True
    made.send(0, 0)
    made.sender.is_allowed = False
    made.send(0)
    assert made.sent == [1, 2, 3, 4, 5, 6]


# Between processes.


class Talker(Node):
    numbers = publisher(Int64, "numbers")
    blocks = publisher(UInt8MultiArray, "blocks")

    def say(self, *values: int) -> None:
        for value in values:
            self.numbers.publish(Int64(data=value))


class Ear(Node):
    def declare(self) -> None:
        self.heard: list[int] = []
        self.sizes: list[int] = []

    @subscription("numbers", qos=QoS(depth=100))
    def on_number(self, number: Int64) -> None:
        self.heard.append(number.data)

    @subscription("blocks", qos=QoS(depth=100))
    def on_block(self, block: UInt8MultiArray) -> None:
        self.sizes.append(len(block.data))


class AsyncEar(Node):
    def declare(self) -> None:
        self.heard: list[int] = []

    @subscription("numbers", qos=QoS(depth=100))
    async def on_number(self, number: Int64) -> None:
        self.heard.append(number.data)


KEY = topic_key("/numbers", TypeSupport(Int64).name, TypeSupport(Int64).type_hash)


def outlet(process):
    """The outlet of the numbers."""
    (found,) = (each for each in process.membership._mirror._outlets.values() if each.publisher.topic == "/numbers")
    return found


@asynccontextmanager
async def pair(directory, monkeypatch, ear=Ear):
    """A talker and an ear in a process each, where all that is said in one turn is close."""
    monkeypatch.setattr("busflow.wire.mirror.burst._CLOSE_NS", 10**12)
    here, there = Process(Talker, "here", directory, "there"), Process(ear, "there", directory, "here")
    await asyncio.gather(here.graph.start(), there.graph.start())
    await until(lambda: outlet(here)._bursts.is_allowed)
    here.graph.node(Talker).say(0)
    await until(lambda: there.graph.node(ear).heard == [0])
    yield here, there
    await asyncio.gather(here.graph.stop(), there.graph.stop())


@contextmanager
def wire(directory):
    """How many messages cross at once, each time."""
    counts = []

    def note(sample):
        counts.append(len(sample.attachment.to_bytes()) // 33)

    callback = zenoh.handlers.Callback(note, indirect=False)
    with open_session(directory) as session, session.declare_subscriber(f"{KEY}/**", callback):
        yield counts


@SHARED
@pytest.mark.parametrize("ear", [Ear, AsyncEar])
@pytest.mark.asyncio
async def test_bursts_that_the_queue_has_room_for_arrive_whole(directory, monkeypatch, ear):
    async with pair(directory, monkeypatch, ear) as (here, there):
        talker, heard = here.graph.node(Talker), there.graph.node(ear).heard
        with wire(directory) as counts:
            await until(lambda: talker.say(0) or counts)
            await until(lambda: heard[-1:] == [0] and len(heard) == talker.numbers.published)
            del heard[:]
            talker.say(*range(1, 101))
            await until(lambda: heard[-1:] == [100])
            assert heard == [*range(1, 101)]
            await until(lambda: counts[-4:] == [32, 32, 32, 4])  # the zeros may come late to this session
        topic = there.graph.bus.topics["/numbers"].statistics()
        assert (topic.losses, topic.subscriptions[0].dropped) == ({}, 0)
        assert topic.published == topic.subscriptions[0].delivered == talker.numbers.published


@SHARED
@pytest.mark.parametrize("of_the_session", [False, True])
@pytest.mark.asyncio
async def test_end_in_the_same_turn_loses_nothing(directory, monkeypatch, of_the_session):
    async with pair(directory, monkeypatch) as (here, there):
        talker, heard = here.graph.node(Talker), there.graph.node(Ear).heard
        talker.say(1)
        assert outlet(here)._bursts._waiting
        if of_the_session:
            mirror, here.membership._mirror = here.membership._mirror, None
            mirror.close()
        else:
            talker.numbers.close()
        await until(lambda: heard[-1:] == [1])


@SHARED
@pytest.mark.asyncio
async def test_large_message_never_overtakes_a_burst(directory, monkeypatch):
    async with pair(directory, monkeypatch) as (here, there):
        blocks, seen = here.graph.node(Talker).blocks, there.graph.node(Ear).sizes
        blocks.publish(UInt8MultiArray())
        await until(lambda: seen == [0])
        watched, arrived = threading.Event(), threading.Event()
        callback = zenoh.handlers.Callback(
            lambda each: arrived.set() if len(each.payload) >= LARGE else watched.set(), indirect=False
        )
        sizes = [10, 20, 30, LARGE, 40]
        with open_session(directory) as session, session.declare_subscriber("0/blocks/**", callback):
            await until(lambda: blocks.publish(UInt8MultiArray()) or watched.is_set())
            for size in sizes:
                blocks.publish(UInt8MultiArray(data=bytes(size)))
            assert arrived.wait(PATIENCE_S), "the turn does not end before the large one has arrived"
        await until(lambda: seen[-1] == sizes[-1])
        assert [size for size in seen if size] == sizes


@SHARED
@pytest.mark.asyncio
async def test_no_burst_while_another_kind_receives(directory, monkeypatch):
    async with pair(directory, monkeypatch) as (here, there):
        talker, heard, type_ = here.graph.node(Talker), there.graph.node(Ear).heard, TypeSupport(Int64)
        with wire(directory) as counts, open_session(directory) as session:
            end = ("/numbers", type_.name, type_.type_hash, to_text(QoS()))
            token = Token(str(session.info.zid()), 0, 1, TokenKind.SUBSCRIPTION, "/", "ros_2", *end)
            got: list[int] = []
            callback = zenoh.handlers.Callback(got.append, indirect=False)
            with session.declare_subscriber(KEY, callback), session.liveliness().declare_token(str(token)):
                await until(lambda: not outlet(here)._bursts.is_allowed)
                await until(lambda: talker.say(0) or counts)
                talker.say(*range(1, 11))
                await until(lambda: heard[-1:] == [10] and len(got) >= 10)
                assert set(counts) == {1}
            await until(lambda: outlet(here)._bursts.is_allowed)


@SHARED
@pytest.mark.asyncio
async def test_unreadable_burst_is_malformed_and_its_messages_lost(directory, monkeypatch):
    async with pair(directory, monkeypatch) as (here, there):
        talker, heard = here.graph.node(Talker), there.graph.node(Ear).heard
        bad = joined([(b"", Attachment(number, 0, b"g" * 16).encode()) for number in (1, 2)])
        here.membership._mirror._session.put(burst_key(KEY), bad[0][:-1], attachment=bad[1])
        talker.say(1, 2)
        await until(lambda: heard[-1:] == [2])
        assert there.graph.bus.topics["/numbers"].losses == {"malformed": 1}
        talker.numbers.published += 3
        talker.say(3)
        await until(lambda: heard[-1:] == [3])
        assert there.graph.bus.topics["/numbers"].losses == {"malformed": 1, "lost": 3}
        assert outlet(here).sent == len(heard)
