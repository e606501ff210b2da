"""Publishers that go and come back with their link: nothing comes twice, and what is missing is counted."""

import asyncio
from contextlib import asynccontextmanager
from dataclasses import replace

import pytest
import zenoh.ext

from busflow import Durability, Node, QoS, publisher
from busflow.bus.topic import Topic
from busflow.clock import SystemClock
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Int64
from busflow.wire.mirror.arrivals import Arrivals
from busflow.wire.zenoh.keys import Attachment, Token, TokenKind, topic_key
from busflow.wire.zenoh.qos_text import to_text
from tests.vectors import each_case

pytestmark = pytest.mark.asyncio

PATIENCE_S = 60.0


def latched(depth):
    return QoS(durability=Durability.TRANSIENT_LOCAL, depth=depth)


class Beside(Node):
    beside = publisher(Int64, "beside")


class Linked:
    """A transient_local publisher elsewhere, made of plain Zenoh, whose token comes and goes as with a link."""

    def __init__(self, looked, entity=1, depth=10):
        self._looked, self._session = looked, looked.peer.session
        support = TypeSupport(Int64)
        self._key, self._support = topic_key("/map", support.name, support.type_hash), support
        token = Token(str(self._session.info.zid()), 0, entity, TokenKind.PUBLISHER, "/", "elsewhere", "/map")
        self._end = replace(token, type=support.name, hash=support.type_hash, qos=to_text(latched(depth)))
        self._way = zenoh.ext.declare_advanced_publisher(
            self._session,
            self._key,
            cache=zenoh.ext.CacheConfig(max_samples=depth),
            publisher_detection=True,
            sample_miss_detection=zenoh.ext.MissDetectionConfig(heartbeat=None, sporadic_heartbeat=None),
        )
        self._token = None

    def come(self):
        self._token = self._session.liveliness().declare_token(str(self._end))

    def go(self):
        self._token.undeclare()

    async def comes(self):
        self.come()
        await self._looked.ask(self._looked.peer.settle)

    async def goes(self):
        here = len(self._publishers)
        self.go()
        await self._looked.until(lambda: len(self._publishers) < here)

    async def publishes(self, *numbers):
        for number in numbers:
            signed = Attachment(number, 0, self._end.gid).encode()
            await self._looked.ask(self._way.put, self._support.encode(Int64(data=number)), attachment=signed)
        await self._looked.ask(self._looked.peer.settle)  # which takes the same way: all before it have arrived

    @property
    def _publishers(self):
        return self._looked.graph.bus.topics["/map"].publishers

    def close(self):
        self._way.undeclare()


@pytest.fixture
def linked(looked_at):
    @asynccontextmanager
    async def start(**words):
        async with looked_at(Beside) as looked:
            elsewhere = Linked(looked, **words)
            yield looked, elsewhere
            await looked.ask(elsewhere.close)

    return start


async def taken(subscription, count):
    return [(await asyncio.wait_for(anext(subscription), PATIENCE_S)).data for _ in range(count)]


def account(subscription):
    line = subscription.statistics()
    return line.published, line.delivered, line.dropped, line.queued


async def test_kept_messages_come_once_over_two_links(linked):
    async with linked() as (looked, elsewhere):
        here, topic = looked.graph.subscribe(Int64, "map", qos=latched(10)), looked.graph.bus.topics["/map"]
        await elsewhere.comes()
        await elsewhere.publishes(1, 2, 3)
        assert await taken(here, 3) == [1, 2, 3]
        await elsewhere.goes()
        await elsewhere.publishes(4, 5)
        await elsewhere.comes()
        assert await taken(here, 2) == [4, 5]
        await elsewhere.publishes(6)
        assert await taken(here, 1) == [6]
        assert account(here) == (6, 6, 0, 0)
        assert (topic.published, topic.losses) == (6, {})


@each_case("c_history", "zenoh/recovery")
async def test_messages_of_a_broken_link_come_if_kept(linked, case):
    before, _, *after = case["steps"]
    expect = case["expect"]
    received = [int(each) for each in expect.get("received") or expect["received after"]]
    async with linked(depth=case["given"]["publisher_cache"]) as (looked, elsewhere):
        here, topic = looked.graph.subscribe(Int64, "map", qos=latched(10)), looked.graph.bus.topics["/map"]
        await elsewhere.comes()
        await elsewhere.publishes(*map(int, before[1:]))
        assert await taken(here, 1) == [1]
        await elsewhere.goes()
        for step in after:
            if step == "link up":
                await elsewhere.comes()
            elif isinstance(step, list):
                await elsewhere.publishes(*map(int, step[1:]))
        assert await taken(here, len(received)) == received
        assert topic.losses == ({"lost": expect["miss_count"]} if "miss_count" in expect else {})


async def test_subscription_made_without_link_gets_history(linked):
    async with linked() as (looked, elsewhere):
        here = looked.graph.subscribe(Int64, "map", qos=latched(10))
        await elsewhere.comes()
        await elsewhere.publishes(1, 2)
        assert await taken(here, 2) == [1, 2]
        await elsewhere.goes()
        late = looked.graph.subscribe(Int64, "map", qos=latched(10))
        await elsewhere.publishes(3)
        await elsewhere.comes()
        assert await taken(here, 1) == [3]
        assert await taken(late, 3) == [1, 2, 3]
        later = looked.graph.subscribe(Int64, "map", qos=latched(10))
        assert await taken(later, 3) == [1, 2, 3]
        await elsewhere.publishes(4)
        for each, published in ((here, 4), (late, 4), (later, 4)):
            assert await taken(each, 1) == [4]
            assert account(each) == (published, published, 0, 0)


async def test_history_survives_while_another_publisher_stays(linked):
    async with linked() as (looked, elsewhere):
        stays = Linked(looked, entity=2)
        here = looked.graph.subscribe(Int64, "map", qos=latched(10))
        await stays.comes()
        await elsewhere.comes()
        await elsewhere.publishes(1, 2)
        assert await taken(here, 2) == [1, 2]
        await elsewhere.goes()
        late = looked.graph.subscribe(Int64, "map", qos=latched(10))
        await elsewhere.comes()
        assert await taken(late, 2) == [1, 2]
        await elsewhere.publishes(3)
        assert [await taken(each, 1) for each in (here, late)] == [[3], [3]]
        assert account(here) == account(late) == (3, 3, 0, 0)
        await looked.ask(stays.close)


async def test_a_publisher_back_at_once_stays(linked):
    async with linked() as (looked, elsewhere):
        other = Linked(looked, entity=2)
        here, topic = looked.graph.subscribe(Int64, "map", qos=latched(10)), looked.graph.bus.topics["/map"]
        await elsewhere.comes()
        await elsewhere.publishes(1)
        assert await taken(here, 1) == [1]
        (before,) = topic.publishers
        await other.comes()
        elsewhere.go()
        await elsewhere.comes()
        await other.goes()  # after which the time to take the last messages of either is over
        assert topic.publishers == [before]
        await elsewhere.publishes(2)
        assert await taken(here, 1) == [2]
        await looked.ask(other.close)


async def test_a_full_record_forgets_its_oldest_entries():
    arrivals = Arrivals(topic := Topic("/map", Int64, SystemClock(), print))
    many = [number.to_bytes(16, "big") for number in range(1, 300)]
    for gid in many:
        assert arrivals.note(gid, 1)
        arrivals.leave(gid)
    assert [arrivals.come(many[0]), arrivals.come(many[-1])] == [None, []]
    for number in range(3, 300, 2):
        assert arrivals.note(many[-1], number)
    assert topic.losses == {"lost": 149}
    assert [arrivals.note(many[-1], number) for number in (2, 298)] == [False, True]
    assert topic.losses == {"lost": 148}


async def test_a_publisher_that_counts_anew_loses_none():
    topic = Topic("/map", Int64, SystemClock(), print)
    numbers = Arrivals(topic)
    assert all(numbers.note(bytes(16), number) for number in (7, 2**62, 2**62 + 2, 8, 10))
    assert topic.losses == {"lost": 2}
    assert numbers.note(bytes(16), 9)
    assert not numbers.note(bytes(16), 10)
    assert topic.losses == {"lost": 1}


async def test_kept_messages_count_once_however_they_come():
    arrivals, gid = Arrivals(topic := Topic("/map", Int64, SystemClock(), print)), bytes(16)
    arrivals.note_kept(gid, [1, 2, 3])
    arrivals.note_kept(gid, [2, 3, 4])
    assert topic.statistics().published == topic.statistics().arrived == 4
    assert arrivals.note(gid, 4, ordered=True), "it comes by itself too, and is published"
    assert topic.earlier == 3
    assert arrivals.note(gid, 7, ordered=True)
    assert topic.losses == {"lost": 2}
    arrivals.note_kept(gid, [3, 4, 6, 7])
    assert (topic.earlier, topic.losses) == (4, {"lost": 1}), "only the sixth is new, and lost no more"
    arrivals.leave(gid)
    assert arrivals.come(gid) == []
    arrivals.note_kept(gid, [1, 2, 3, 6, 7])
    assert topic.earlier == 4


async def test_kept_messages_of_many_publishers_are_forgotten():
    arrivals = Arrivals(topic := Topic("/map", Int64, SystemClock(), print))
    many = [number.to_bytes(16, "big") for number in range(1, 600)]
    for gid in many:
        arrivals.note_kept(gid, [1])
    arrivals.note_kept(many[-1], [1])
    assert topic.earlier == 599
    arrivals.note_kept(many[0], [1])
    assert topic.earlier == 600, "it is a new one again"
