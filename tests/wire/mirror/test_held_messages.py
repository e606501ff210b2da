"""The first messages of a new publisher: they wait for the processes that receive its topic."""

import asyncio
from contextlib import asynccontextmanager

import pytest

from busflow import Durability, Node, QoS, subscription
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Int64
from busflow.wire.zenoh.keys import QUERY_PREFIX, Token, TokenKind
from busflow.wire.zenoh.qos_text import to_text
from busflow.wire.zenoh.session import open_session
from tests.wire.mirror.processes import Process, until

pytestmark = pytest.mark.asyncio


class Idle(Node):
    pass


class Listener(Node):
    heard = ()

    @subscription("numbers", qos=QoS(depth=5))
    def hear(self, number: Int64) -> None:
        self.heard = (*self.heard, number.data)


class LateJoiner(Node):
    heard = ()

    @subscription("numbers", qos=QoS(depth=5, durability=Durability.TRANSIENT_LOCAL))
    def hear(self, number: Int64) -> None:
        self.heard = (*self.heard, number.data)


@asynccontextmanager
async def running(directory, *nodes):
    """Graphs of these nodes, in processes of one run that are linked."""
    names = [str(number) for number in range(len(nodes))]
    processes = [Process(node, name, directory, *names) for node, name in zip(nodes, names, strict=True)]
    for each in processes:
        each.others = tuple(name for name in names if processes[int(name)] is not each)
    await asyncio.gather(*(each.graph.start() for each in processes))
    yield [each.graph for each in processes]
    for each in processes:
        await each.graph.stop()


def numbers(graph, *values):
    """Make a publisher and publish these at once."""
    publisher = graph.advertise(Int64, "numbers")
    for value in values:
        publisher.publish(Int64(data=value))
    return publisher


def losses(graph):
    return graph.bus.topics["/numbers"].losses


async def test_first_messages_reach_every_process(directory):
    async with running(directory, Idle, Listener, Listener) as (here, *others):
        publisher = numbers(here, 1, 2, 3)
        await until(lambda: all(each.node(Listener).heard == (1, 2, 3) for each in others))
        publisher.publish(Int64(data=4))
        await until(lambda: all(each.node(Listener).heard == (1, 2, 3, 4) for each in others))
        assert losses(here) == {}


async def test_messages_beyond_the_depth_are_early(directory):
    async with running(directory, Idle, Listener) as (here, there):
        numbers(here, *range(8))
        await until(lambda: there.node(Listener).heard == (3, 4, 5, 6, 7))
        assert losses(here) == {"early": 3}


async def test_nothing_is_held_for_an_unfit_subscription(directory):
    async with running(directory, Idle, LateJoiner) as (here, there):
        publisher = numbers(here, 1, 2)
        await until(lambda: not publisher.is_received)
        assert (there.node(LateJoiner).heard, losses(here)) == ((), {})


async def test_a_publisher_that_ends_leaves_its_messages_early(directory):
    async with running(directory, Idle, Listener) as (here, _):
        numbers(here, 1, 2).close()
        assert losses(here) == {"early": 2}


async def test_a_process_without_answer_is_waited_for_briefly(directory):
    async with running(directory, Idle) as (here,):
        session, asked = await asyncio.to_thread(open_session, directory), []
        type_, zid = TypeSupport(Int64), str(session.info.zid())
        end = ("/numbers", type_.name, type_.type_hash, to_text(QoS()))
        blocked = Token(zid, 0, 1, TokenKind.SUBSCRIPTION, "/", "blocked", *end)
        with (
            session.declare_queryable(f"{QUERY_PREFIX}/blocked/run", asked.append),
            session.liveliness().declare_token(str(blocked)),
        ):
            publisher = here.advertise(Int64, "numbers")
            await until(lambda: publisher.is_received)
            publisher.publish(Int64(data=1))
            await until(lambda: losses(here) == {"early": 1})
            assert len(asked) == 1
            asked.clear()
        await asyncio.to_thread(session.close)
