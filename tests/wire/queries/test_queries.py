"""What a run answers about itself: its nodes, topics, parameters, types, kept messages and counts."""

import pytest

from busflow import Node, Parameters, publisher, subscription
from busflow.msgs.std_msgs import Int64, String

pytestmark = pytest.mark.asyncio


class TalkerParameters(Parameters):
    rate_hz: float = 5.0


class Talker(Node):
    parameters: TalkerParameters
    numbers = publisher(Int64, "numbers")
    words = publisher(String, "words")


class Ear(Node):
    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        pass


async def test_a_run_says_what_it_is(looked_at):
    async with looked_at(Talker, Ear) as looked:
        (told,) = await looked.ask(looked.peer.ask, "run")
        assert (told["name"], told["nodes"], told["clock"], told["process"]) == ("looked", 2, "system", "main")
        (report,) = await looked.ask(looked.peer.ask, "report")
        assert {node["name"] for node in report["nodes"]} == {"/talker", "/ear"}
        (graph,) = await looked.ask(looked.peer.ask, "graph")
        topics = {topic["name"]: topic for topic in graph["topics"]}
        assert topics["/numbers"]["subscriptions"][0]["delivered"] == 0
        (parameters,) = await looked.ask(looked.peer.ask, "parameters", node="/talker")
        assert [(each["name"], each["value"]) for each in parameters["/talker"]] == [("rate_hz", 5.0)]
        (types,) = await looked.ask(looked.peer.ask, "types", names=["std_msgs/msg/Int64"])
        assert list(types) == ["std_msgs/msg/Int64"]


async def test_the_last_message_of_volatile_topics_is_kept(looked_at):
    async with looked_at(Talker) as looked:
        for number in range(3):
            looked.graph.node(Talker).numbers.publish(Int64(data=number))
        ((told, messages),) = await looked.ask(looked.peer.ask_for_messages, "history", topic="/numbers", count=5)
        assert (told["depth"], told["published"], told["count"]) == (1, 3, 1)
        type_ = await looked.ask(looked.peer.type, told["type"])
        assert [(each.sequence, type_.decode(each.payload)["data"]) for each in messages] == [(3, 2)]
