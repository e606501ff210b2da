"""Who comes late to a topic has what publishers elsewhere keep, whoever received it before."""

import asyncio
from contextlib import AsyncExitStack, asynccontextmanager, contextmanager
from dataclasses import replace

import pytest
import zenoh

from busflow import Durability, Node, QoS, publisher
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Int64
from busflow.processes.report import merged
from busflow.wire.zenoh.keys import Attachment, Token, TokenKind, topic_key
from busflow.wire.zenoh.qos_text import to_text
from tests.processes.test_report import Member, told

pytestmark = pytest.mark.asyncio

PATIENCE_S = 60.0


def latched(depth):
    return QoS(durability=Durability.TRANSIENT_LOCAL, depth=depth)


class Namer(Node):
    """Says what an Int64 is, to who has no types of its own."""

    numbers = publisher(Int64, "of_namer")


class Outside:
    """Publishers in another session, which keep what they publish."""

    def __init__(self, looked, stack):
        self._looked, self._stack = looked, stack

    async def advertises(self, depth=5):
        type_ = await self._looked.ask(self._looked.peer.type, "std_msgs/msg/Int64")
        peer = self._looked.peer
        advertising = peer.advertise("/map", type_, qos=to_text(latched(depth)))
        speaker = await self._looked.ask(self._stack.enter_context, advertising)

        async def publish(*numbers):
            for number in numbers:
                await self._looked.ask(speaker.publish, {"data": number})
            await self._looked.ask(peer.settle)  # which takes the same way: all before it have arrived

        return publish

    async def settle(self):
        """Wait until they know of what has just subscribed here."""
        await self._looked.ask(self._looked.peer.settle)


@pytest.fixture
def outside(looked_at):
    @asynccontextmanager
    async def start():
        async with looked_at(Namer) as looked, AsyncExitStack() as stack:
            yield looked, Outside(looked, stack)

    return start


async def taken(subscription, count):
    return [(await asyncio.wait_for(anext(subscription), PATIENCE_S)).data for _ in range(count)]


def balances(*subscriptions):
    lines = [each.statistics() for each in subscriptions]
    return [line.published - line.delivered - line.dropped - line.queued for line in lines] == [0] * len(lines)


async def test_history_comes_first_and_without_duplicates(outside):
    async with outside() as (looked, others):
        publish = await others.advertises()
        await publish(1, 2, 3)
        volatile = looked.graph.subscribe(Int64, "map")
        await others.settle()
        await publish(4, 5)
        assert await taken(volatile, 2) == [4, 5]
        late = looked.graph.subscribe(Int64, "map", qos=latched(10))
        shallow = looked.graph.subscribe(Int64, "map", qos=latched(2))
        assert await taken(late, 5) == [1, 2, 3, 4, 5]
        assert await taken(shallow, 2) == [4, 5]
        later = looked.graph.subscribe(Int64, "map", qos=latched(10))
        assert await taken(later, 5) == [1, 2, 3, 4, 5], "it is known here by now"
        await publish(6)
        for each in (late, shallow, later, volatile):
            assert await taken(each, 1) == [6]
        assert balances(late, shallow, later, volatile)
        assert looked.graph.bus.topics["/map"].losses == {}


async def test_a_deeper_late_subscription_gets_more_history(outside):
    async with outside() as (looked, others):
        publish = await others.advertises()
        await publish(1, 2, 3, 4)
        first = looked.graph.subscribe(Int64, "map", qos=latched(1))
        assert await taken(first, 1) == [4]
        late = looked.graph.subscribe(Int64, "map", qos=latched(3))
        assert await taken(late, 3) == [2, 3, 4]
        await publish(5)
        assert [await taken(each, 1) for each in (first, late)] == [[5], [5]]
        assert balances(first, late)


async def test_history_has_no_gap_or_duplicate_under_load(outside):
    async with outside() as (looked, others):
        publish = await others.advertises(depth=1000)
        looked.graph.subscribe(Int64, "map")
        await others.settle()
        speaking = asyncio.create_task(publish(*range(1, 301)))
        topic = looked.graph.bus.topics["/map"]
        late = []
        for count in (1, 100, 200):
            await looked.until(lambda count=count: topic.published >= count)
            late.append(looked.graph.subscribe(Int64, "map", qos=latched(1000)))
        for each in late:
            assert await taken(each, 300) == [*range(1, 301)]
        await speaking
        assert balances(*late)


async def test_a_later_publisher_is_asked_for_history_too(outside):
    async with outside() as (looked, others):
        publish = await others.advertises()
        volatile = looked.graph.subscribe(Int64, "map")
        await others.settle()
        late = looked.graph.subscribe(Int64, "map", qos=latched(10))
        await publish(1)
        assert await taken(late, 1) == [1]
        with keeping(looked.peer.session, 11, 12):
            assert await taken(late, 2) == [11, 12]
            await publish(2)
            assert await taken(late, 1) == [2]
            assert await taken(volatile, 2) == [1, 2]
            assert balances(late, volatile)


@contextmanager
def keeping(session, *numbers):
    """A publisher that keeps what it published before anybody here could hear it, as Zenoh's advanced one does."""
    support = TypeSupport(Int64)
    key = topic_key("/map", support.name, support.type_hash)
    end = Token(
        str(session.info.zid()), 0, 99, TokenKind.PUBLISHER, "/", "early", "/map", support.name, support.type_hash
    )
    end = replace(end, qos=to_text(latched(5)))

    def answer(query):
        for sequence, number in enumerate(numbers, 1):
            signed = Attachment(sequence, 0, end.gid).encode()
            query.reply(key, support.encode(Int64(data=number)), attachment=signed)

    told = zenoh.handlers.Callback(answer, indirect=False)
    with (
        session.declare_queryable(f"{key}/@adv/pub/early", told),
        session.liveliness().declare_token(str(end)),
    ):
        yield


async def test_one_that_leaves_at_once_leaves_nothing_behind(outside):
    async with outside() as (looked, others):
        publish = await others.advertises()
        await publish(1, 2)
        volatile = looked.graph.subscribe(Int64, "map")
        await others.settle()
        gone = looked.graph.subscribe(Int64, "map", qos=latched(5))
        gone.close()
        late = looked.graph.subscribe(Int64, "map", qos=latched(5))
        assert await taken(late, 2) == [1, 2]
        assert balances(gone, late, volatile)


@contextmanager
def keeper(session, *kept):
    """Show a publisher with kept messages that nobody can ask for yet; yield how it publishes, and how it answers."""
    support = TypeSupport(Int64)
    key = topic_key("/map", support.name, support.type_hash)
    token = Token(str(session.info.zid()), 0, 1, TokenKind.PUBLISHER, "/", "keeper", "/map")
    token = replace(token, type=support.name, hash=support.type_hash, qos=to_text(latched(10)))

    def signed(number):
        return {"payload": support.encode(Int64(data=number)), "attachment": Attachment(number, 0, token.gid).encode()}

    def answer(query):
        with query:
            for number in kept:
                query.reply(key, **signed(number))

    shown = session.liveliness().declare_token(str(token))
    yield (
        lambda number: session.put(key, **signed(number)),
        lambda: session.declare_queryable(f"{key}/@adv/pub/keeper/1/_", answer),
    )
    shown.undeclare()


async def test_kept_messages_asked_for_too_early_come_first(outside):
    async with outside() as (looked, _others):
        subscription = looked.graph.subscribe(Int64, "map", qos=latched(10))
        with keeper(looked.peer.session, 1, 2, 3) as (publish, begin_to_answer):
            await looked.ask(looked.peer.settle)  # here it has been asked, and did not answer
            answering = await looked.ask(begin_to_answer)
            for number in (4, 5):
                await looked.ask(publish, number)
            assert await taken(subscription, 5) == [1, 2, 3, 4, 5]
            await looked.ask(publish, 2)  # as after a broken link
            await looked.ask(publish, 6)
            assert await taken(subscription, 1) == [6]
            assert balances(subscription)
            answering.undeclare()


async def test_kept_messages_that_came_late_are_no_drops(outside):
    async with outside() as (looked, _others):
        subscription = looked.graph.subscribe(Int64, "map", qos=latched(10))
        with keeper(looked.peer.session, 1, 2, 3) as (publish, begin_to_answer):
            await looked.ask(looked.peer.settle)  # here it has been asked, and did not answer
            answering = await looked.ask(begin_to_answer)
            await looked.ask(publish, 4)
            assert await taken(subscription, 4) == [1, 2, 3, 4]
            answering.undeclare()
            source = told("/keeper", published=4)
            source["topics"][0]["name"] = "/map"
            report = merged(looked.graph.report(), [Member("elsewhere", ("/keeper",), report=source)], ["/keeper"])
            (topic,) = (each for each in report.topics if each.name == "/map")
            (line,) = topic.subscriptions
            assert topic.published == line.published == line.delivered == 4
            assert line.drops == {}
