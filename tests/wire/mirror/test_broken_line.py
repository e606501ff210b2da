"""A line that breaks while both of its processes live: messages go on, and each that is missing is accounted for."""

import asyncio
import socket
import threading
from contextlib import asynccontextmanager
from math import inf

import pytest

from busflow import Node, QoS, publisher, subscription
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.std_msgs import Int64
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import to_text
from busflow.wire.zenoh.session import open_session
from tests.wire.mirror.processes import Process, until

pytestmark = pytest.mark.asyncio


class Talker(Node):
    numbers = publisher(Int64, "numbers")
    others = publisher(Int64, "others")

    def say(self) -> None:
        for end in (self.numbers, self.others):
            end.publish(Int64(data=end.published))


class Ear(Node):
    def declare(self) -> None:
        self.heard = 0

    @subscription("numbers", qos=QoS(depth=100))
    def on_number(self, number: Int64) -> None:
        self.heard = number.data

    @subscription("others", qos=QoS(depth=100))
    def on_other(self, _: Int64) -> None:
        """Take it."""


@asynccontextmanager
async def pair(directory):
    here, there = Process(Talker, "here", directory, "there"), Process(Ear, "there", directory, "here")
    await asyncio.gather(here.graph.start(), there.graph.start())
    yield here, there
    await asyncio.gather(here.graph.stop(), there.graph.stop())


def break_lines(process):
    for line in process.membership._mirror._lines._lines:
        line._socket.shutdown(socket.SHUT_RDWR)


async def goes_on(here, there):
    """Wait until a number arrives that was published from now on."""
    talker, ear = here.graph.node(Talker), there.graph.node(Ear)
    last = talker.numbers.published
    await until(lambda: talker.say() or ear.heard > last)


def feeds():
    return [each for each in threading.enumerate() if "inlet" in each.name]


async def test_messages_go_on_by_another_line_and_then_through_zenoh(directory, capsys):
    async with pair(directory) as (here, there):
        await goes_on(here, there)
        break_lines(here)
        await goes_on(here, there)
        assert feeds() == []
        break_lines(here)
        await goes_on(here, there)
        assert len(feeds()) == 2
        talker = here.graph.node(Talker)
        await until(lambda: there.graph.node(Ear).heard == talker.numbers.published - 1)
        topic = there.graph.bus.topics["/numbers"].statistics()
        assert topic.subscriptions[0].dropped == 0
        assert topic.published + topic.losses.get("lost", 0) == talker.numbers.published
        assert topic.subscriptions[0].lost.get("link", 0) == topic.losses.get("lost", 0)
        told = []
        await until(lambda: told.extend(warned_of_zenoh(capsys)) or told)
    assert told + warned_of_zenoh(capsys) == ["/talker come through Zenoh: the line to it has ended"]


def warned_of_zenoh(capsys):
    """Whose messages come through Zenoh, and why, as the log says."""
    begin = "messages of the process of "
    return [line.partition(begin)[2] for line in capsys.readouterr().err.splitlines() if begin in line]


async def test_messages_for_which_a_reader_has_no_room_at_the_end_are_lost_to_it(directory):
    here, there = Process(Talker, "here", directory, "there"), Process(Ear, "there", directory, "here")
    await asyncio.gather(here.graph.start(), there.graph.start())
    await goes_on(here, there)
    for _ in range(5000):  # in one turn of the loop: nothing is read meanwhile
        here.graph.node(Talker).say()
    mirror = here.membership._mirror
    mirror._lines.finish(0)
    mirror._lines.close()
    mirror._session.close()
    topic = there.graph.bus.topics["/numbers"]
    await until(lambda: not topic.publishers)
    found = topic.statistics()
    assert found.losses == {"lost": 100}
    assert found.subscriptions[0].lost == {"end": 100}
    assert found.published + 100 == here.graph.node(Talker).numbers.published
    await asyncio.gather(here.graph.stop(), there.graph.stop())


async def test_process_whose_socket_is_out_of_reach_is_received_through_zenoh(directory, capsys):
    """As by a container that does not see the run's directory; two topics make one line in the log."""
    here, there = Process(Talker, "here", directory, "there"), Process(Ear, "there", directory, "here")
    starting = asyncio.create_task(here.graph.start())
    await until(lambda: [*directory.glob("~*")])
    for each in directory.glob("~*"):
        each.unlink()
    await asyncio.gather(starting, there.graph.start())
    await goes_on(here, there)
    assert len(feeds()) == 2
    told = []
    await until(lambda: told.extend(warned_of_zenoh(capsys)) or told)
    await asyncio.gather(here.graph.stop(), there.graph.stop())
    told += warned_of_zenoh(capsys)
    why = "its socket in the run's directory cannot be reached: No such file or directory"
    assert told == [f"/talker come through Zenoh: {why}"]


async def test_command_that_publishes_is_received_through_zenoh_without_a_word(directory, capsys, limits):
    """It never has a line."""
    limits(departure=0.0)
    here, there = Process(Talker, "here", directory, "main"), Process(Ear, "main", directory, "here")
    await asyncio.gather(here.graph.start(), there.graph.start())
    session = open_session(directory)
    support = TypeSupport(Int64)
    end = ("/numbers", support.name, support.type_hash, to_text(QoS()))
    token = Token(str(session.info.zid()), 0, 1, TokenKind.PUBLISHER, "/", "_busflow_cli_7", *end)
    shown = session.liveliness().declare_token(str(token))
    topic = there.graph.bus.topics["/numbers"]
    await until(lambda: len(topic.publishers) == 2)
    await goes_on(here, there)
    shown.undeclare()
    await until(lambda: len(topic.publishers) == 1)
    session.close()
    await asyncio.gather(here.graph.stop(), there.graph.stop())
    assert warned_of_zenoh(capsys) == []


async def test_publisher_leaves_with_its_line_at_once(directory, limits):
    """As at a kill: neither the line nor the session says goodbye."""
    here, there = Process(Talker, "here", directory, "main"), Process(Ear, "main", directory, "here")
    await asyncio.gather(here.graph.start(), there.graph.start())
    await goes_on(here, there)
    limits(departure=inf)
    mirror = here.membership._mirror
    mirror._lines.close()
    mirror._session.close()
    await until(lambda: not there.graph.bus.topics["/numbers"].publishers)
    await asyncio.gather(here.graph.stop(), there.graph.stop())
