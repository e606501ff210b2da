"""What cannot go from one process to another is found before anything starts."""

import pytest
from pydantic import Field

from busflow import Node, client, publisher, subscription
from busflow.bus.qos import QoS
from busflow.interfaces.message import Message
from busflow.launchfile.model.placement import Placement
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger
from busflow.node.supervision import supervised
from busflow.processes.crossing import crossing_problems
from busflow.runner.graph import Graph


class Plain(Message, package="test"):
    """Travels as JSON, since ROS has no word for it."""

    words: dict[str, int] = Field(default_factory=dict)


class Source(Node):
    numbers = publisher(Int64, "numbers")
    plain = publisher(Plain, "plain")


class Sink(Node):
    ask = client(Trigger, "ask")

    @subscription("numbers", qos=QoS(overflow="block"))
    def hear(self, number: Int64) -> None: ...

    @subscription("plain")
    def hear_plain(self, plain: Plain) -> None: ...


def found(*what, apart):
    nodes = {"main": ("/source",), "other": ("/sink",)} if apart else {"main": ("/source", "/sink")}
    return [(each.code, each.message) for each in crossing_problems(Graph(what).plan(), Placement(nodes, {}))]


def test_blocking_queue_cannot_delay_remote_publisher(golden):
    ((code, message),) = found(Source, Sink, apart=True)
    assert code == "cannot-block"
    golden(message)


def test_in_one_process_it_can():
    assert found(Source, Sink, apart=False) == []


@pytest.mark.parametrize("apart", [True, False])
def test_depends_on_another_process_is_refused(apart):
    waiting = supervised(Source, depends_on={"sink": "started"})
    assert ("cannot-depend" in [code for code, _ in found(waiting, Sink, apart=apart)]) is apart
