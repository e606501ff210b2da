"""Delays and losses of a topic, on a bus without a harness."""

from busflow import Graph, Node
from busflow.clock import SimClock
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time
from busflow.testing.link_faults import Faults


@virtual_time
async def test_every_second_message_is_lost():
    async with Graph([Node(name="idle")], clock=SimClock()) as graph:
        faults = Faults(graph.bus)
        inbox = graph.subscribe(Int64, "numbers")
        source = graph.advertise(Int64, "numbers")
        faults.drop("/numbers", 2)
        for number in range(4):
            source.publish(Int64(data=number))
        assert [(await anext(inbox)).data for _ in range(2)] == [0, 2]
        assert inbox.queued == 0


@virtual_time
async def test_impossible_faults_are_refused(golden):
    async with Graph([Node(name="idle")], clock=SimClock()) as graph:
        faults = Faults(graph.bus)
        with golden.raises(ValueError):
            faults.delay("/numbers", float("inf"))
        with golden.raises(ValueError):
            faults.drop("/numbers", 0)
