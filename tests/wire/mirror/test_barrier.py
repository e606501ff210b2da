"""No node of a run starts before all its processes can hear each other: real sessions, each with a graph of its own."""

import asyncio

import pytest

from busflow import Node, QoS, publisher, subscription
from busflow.msgs.std_msgs import Int64
from tests.wire.mirror.processes import Process, until

pytestmark = pytest.mark.asyncio


class Talker(Node):
    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        for number in range(200):
            self.numbers.publish(Int64(data=number))


class Listener(Node):
    heard = ()

    @subscription("numbers", qos=QoS(depth=1000))
    def hear(self, number: Int64) -> None:
        self.heard = (*self.heard, number.data)


async def test_the_barrier_loses_no_first_message(directory):
    talker = Process(Talker, "talker", directory, "listener")
    starting = asyncio.create_task(talker.graph.start())
    await talker.waits.wait()
    assert [line.split()[0] for line in talker.barrier.lacking(["listener"])] == ["listener"]
    assert not starting.done()
    listener = Process(Listener, "listener", directory, "talker")
    await asyncio.gather(starting, listener.graph.start())
    await until(lambda: len(listener.graph.node(Listener).heard) == 200)
    assert listener.graph.node(Listener).heard == tuple(range(200))
    assert talker.barrier.lacking(["listener"]) == listener.barrier.lacking(["talker"]) == []
    assert (talker.changes, listener.changes) == ([("listener", True)], [("talker", True)])
    await listener.graph.stop()
    await until(lambda: talker.changes[-1] == ("listener", False))
    await talker.graph.stop()


async def test_process_that_has_gone_is_not_waited_for(directory):
    first = Process(Listener, "first", directory)
    await first.graph.start()
    talker = Process(Talker, "talker", directory, "first", "never")
    starting = asyncio.create_task(talker.graph.start())
    await talker.waits.wait()
    await until(lambda: talker.barrier.lacking(["first", "never"]) == ["never has not joined the run"])
    await first.graph.stop()
    await until(lambda: talker.changes == [("first", True), ("first", False)])
    assert talker.barrier.lacking(["first"]) == []
    assert not starting.done()
    talker.graph.ask_to_stop()  # nobody wants it any more
    await starting


async def test_the_barrier_waits_for_a_returning_process(directory):
    listener = Process(Listener, "listener", directory)
    await listener.graph.start()
    for life in (1, 2):
        talker = Process(Talker, "talker", directory, "listener")
        await talker.graph.start()
        await until(lambda life=life: len(listener.graph.node(Listener).heard) == 200 * life)
        await talker.graph.stop()
    assert listener.graph.node(Listener).heard == (*range(200), *range(200))
    await listener.graph.stop()
