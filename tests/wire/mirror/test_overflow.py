"""Messages that come from another process while a handler is busy: each queue gets them as in one process.

Tests of `inlet.py` and `arrival_buffer.py`.
"""

import asyncio
import threading
from contextlib import asynccontextmanager
from math import inf

import pytest

from busflow import MessageLost, Node, Overflow, QoS, Reliability, on_event, publisher, subscription
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import UInt8MultiArray
from busflow.wire.zenoh.keys import Attachment, Token, TokenKind, topic_key
from busflow.wire.zenoh.qos_text import to_text
from busflow.wire.zenoh.session import open_session
from tests.wire.mirror.processes import PATIENCE_S, Process, until

pytestmark = pytest.mark.asyncio

TYPE = TypeSupport(UInt8MultiArray)
_PIECES = 2
"""How many large messages a line gives to its reader before that acknowledges one."""
KEY = topic_key("/blocks", TYPE.name, TYPE.type_hash)


class Source:
    """A publisher that is no node of busflow, and that any thread may use."""

    def __init__(self, directory, reader):
        self._session, self._arrived = open_session(directory), threading.Event()
        zid, end = str(self._session.info.zid()), ("/blocks", TYPE.name, TYPE.type_hash, to_text(QoS()))
        self._token = Token(zid, 0, 1, TokenKind.PUBLISHER, "/", "source", *end)
        self._declared = [
            self._session.liveliness().declare_token(str(self._token)),
            reader.membership._mirror._session.declare_subscriber("end", lambda _: self._arrived.set()),
        ]
        self.published = 0

    def publish(self, count, size=1):
        """Publish so many blocks, and wait until all have arrived; the first byte of each is its number."""
        for _ in range(count):
            block = UInt8MultiArray(data=bytes([self.published % 256]) * size)
            self.published += 1
            self._session.put(
                KEY, TYPE.encode(block), attachment=Attachment(self.published, 0, self._token.gid).encode()
            )
        self._arrived.clear()
        self._session.put("end", b"")
        assert self._arrived.wait(PATIENCE_S)

    def close(self):
        self._session.close()


class Talker(Node):
    """Publishes in a process with a line to the reader's; both are on one loop."""

    blocks = publisher(UInt8MultiArray, "blocks", qos=QoS(depth=100))

    def declare(self) -> None:
        self.published = 0

    def publish(self, count: int, size: int = 1) -> None:
        for _ in range(count):
            self.blocks.publish(UInt8MultiArray(data=bytes([self.published % 256]) * size))
            self.published += 1


class Reader(Node):
    """Notes the number of each block, and does as the test says at the first one."""

    def declare(self) -> None:
        self.heard: list[int] = []
        self.meanwhile = lambda: None

    def on_block(self, block: UInt8MultiArray) -> None:
        self.heard.append(int(block.data[0]))
        if len(self.heard) == 1:
            self.meanwhile()


class Busy(Reader):
    @subscription("blocks", qos=QoS(depth=1))
    def on_one(self, block: UInt8MultiArray) -> None:
        self.on_block(block)


class BestEffort(Reader):
    @subscription("blocks", qos=QoS(depth=1, reliability=Reliability.BEST_EFFORT))
    def on_one(self, block: UInt8MultiArray) -> None:
        self.on_block(block)


class Three(Reader):
    @subscription("blocks", qos=QoS(depth=3))
    def on_three(self, block: UInt8MultiArray) -> None:
        self.on_block(block)


class Newest(Reader):
    @subscription("blocks", qos=QoS(depth=2, overflow=Overflow.DROP_NEWEST))
    def on_two(self, block: UInt8MultiArray) -> None:
        self.on_block(block)


class Notified(Busy):
    def declare(self) -> None:
        super().declare()
        self.events: list[MessageLost] = []

    @on_event("blocks")
    def on_lost(self, event: MessageLost) -> None:
        self.events.append(event)


class Both(Busy):
    """Has a deep queue beside the short one."""

    def declare(self) -> None:
        super().declare()
        self.all: list[int] = []

    @subscription("blocks", qos=QoS(depth=100))
    def on_all(self, block: UInt8MultiArray) -> None:
        self.all.append(int(block.data[0]))


@pytest.fixture(params=["zenoh", "line"])
def receiving(directory, request):
    """A process with a node, and a source whose first block the node has not handled."""

    @asynccontextmanager
    async def receiving(node):
        process = Process(node, "reader", directory, *(["source"] if request.param == "line" else []))
        bus = process.graph.bus
        if request.param == "line":
            other = Process(Talker, "source", directory, "reader")
            await asyncio.gather(process.graph.start(), other.graph.start())
            yield process.graph.node(node), bus.topics["/blocks"], other.graph.node(Talker)
            assert not [each for each in threading.enumerate() if "inlet" in each.name], "nothing came through Zenoh"
            await other.graph.stop()
        else:
            await process.graph.start()
            source = Source(directory, process)
            await until(lambda: bus.topics["/blocks"].publishers)
            yield process.graph.node(node), bus.topics["/blocks"], source
            source.close()
        await process.graph.stop()

    return receiving


def accounted(topic, published):
    """The overflow of each subscription, whose account is even and holds all that was published."""
    lines = topic.statistics().subscriptions
    assert topic.losses == {}
    for line in lines:
        assert line.published == published
        assert line.published == line.delivered + line.dropped + line.queued
        assert set(line.drops) <= {"overflow"}
    return [line.dropped for line in lines]


@pytest.mark.parametrize(
    ("node", "heard"),
    [(Busy, [0, 12]), (BestEffort, [0, 12]), (Three, [0, 10, 11, 12]), (Newest, [0, 1, 2])],
)
@pytest.mark.parametrize("size", [1, 100_000])
async def test_busy_handler_gets_what_its_queue_would_have_kept(receiving, node, heard, size):
    async with receiving(node) as (reader, topic, source):
        reader.meanwhile = lambda: source.publish(12, size)
        source.publish(1)
        await until(lambda: topic.published == 13 and len(reader.heard) >= len(heard))
        under_way = (
            max(len(heard) - 1, _PIECES) if size > 1 and isinstance(source, Talker) else 0
        )  # in the memory of the source's process
        assert len(reader.heard) <= len(heard) + under_way
        newest = reader.heard[1 - len(heard) :] if node is not Newest else reader.heard[1 : len(heard)]
        assert [*reader.heard[:1], *newest] == heard
        assert accounted(topic, 13) == [13 - len(reader.heard)]


@pytest.mark.parametrize(("count", "size"), [(2000, 1), (12, 100_000)])
async def test_newest_message_overtakes_those_under_way(receiving, limits, count, size):
    limits(newer_messages=inf)
    async with receiving(Busy) as (reader, topic, source):
        reader.meanwhile = lambda: source.publish(count, size)
        source.publish(1)
        await until(lambda: topic.published == count + 1 and len(reader.heard) > 1)
        assert reader.heard == [0, count % 256]
        assert accounted(topic, count + 1) == [count - 1]


@pytest.mark.parametrize("node", [Busy, Newest])
async def test_more_than_every_buffer_has_room_for_is_overflow(receiving, node):
    async with receiving(node) as (reader, topic, source):
        reader.meanwhile = lambda: source.publish(600)
        source.publish(1)
        await until(lambda: len(reader.heard) > 1 and topic.published == 601)
        assert accounted(topic, 601) == [601 - len(reader.heard)]


async def test_deep_queue_gets_all_beside_a_short_one(receiving):
    async with receiving(Both) as (reader, topic, source):
        reader.meanwhile = lambda: source.publish(50)
        source.publish(1)
        await until(lambda: len(reader.all) == 51)
        assert (reader.heard, reader.all) == ([0, 50], [*range(51)])
        assert accounted(topic, 51) == [49, 0]


async def test_tap_gets_all_beside_a_short_queue(receiving):
    async with receiving(Busy) as (reader, topic, source):
        tapped = []
        reader.meanwhile = lambda: source.publish(12)
        topic.taps.append(lambda block: tapped.append(int(block.data[0])))
        topic.rebuild()
        source.publish(1)
        await until(lambda: len(reader.heard) == 2)
        assert (reader.heard, tapped) == ([0, 12], [*range(13)])
        assert accounted(topic, 13) == [11]


async def test_node_is_told_of_skipped_messages(receiving):
    async with receiving(Notified) as (reader, topic, source):
        reader.meanwhile = lambda: source.publish(50)
        source.publish(1)
        await until(lambda: len(reader.heard) == 2 and reader.events)
        assert [(event.total, event.total_change) for event in reader.events] == [(49, 49)]
        assert accounted(topic, 51) == [49]


async def test_messages_stay_in_order_while_the_loop_is_busy(receiving, limits):
    limits(busy_loop=0.0)
    async with receiving(Both) as (reader, topic, source):
        for last in range(1, 101, 20):
            source.publish(20)  # the loop waits for them here
            await until(lambda last=last: len(reader.all) == last + 19)
        assert reader.all == [*range(100)]
        assert accounted(topic, 100)[1] == 0
