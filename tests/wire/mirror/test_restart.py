"""A node that is restarted, seen from outside: who listens to it, publishes to it or asks it notices nothing."""

import asyncio
from contextlib import ExitStack

import pytest

from busflow import Node, Parameters, publisher, service, subscription, supervised
from busflow.errors import ServiceError
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger

pytestmark = pytest.mark.asyncio

PATIENCE_S = 60.0


class EchoParameters(Parameters):
    gain: int = 1


class Echo(Node):
    """Repeats numbers, and fails at a negative one."""

    parameters: EchoParameters
    echoes = publisher(Int64, "echoes")

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        if number.data < 0:
            raise ValueError("negative")
        self.echoes.publish(Int64(data=number.data * self.parameters.gain))

    @service(Trigger, "~/lives")
    def on_lives(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True)


def ends(peer):
    """Every end of the node that others see."""
    return sorted((token.kind, token.topic) for token in peer.tokens() if token.node_name == "/echo" and token.topic)


async def test_outside_endpoints_continue_with_the_restarted_node(looked_at):
    async with looked_at(supervised(Echo, restart="on-failure")) as looked:
        peer, graph = looked.peer, looked.graph
        before = await looked.ask(ends, peer)
        kind = await looked.ask(peer.type, "std_msgs/msg/Int64")
        echoes = (await looked.ask(peer.graph)).topic("echoes")
        first = graph.node(Echo)
        with peer.listen(echoes) as listener, ExitStack() as ending:
            speaker = await looked.ask(ending.enter_context, peer.advertise("/numbers", kind))
            await looked.ask(peer.ask, "set_parameters", node="/echo", values={"gain": 10})
            speaker.publish({"data": 1})
            assert kind.decode((await looked.ask(listener.get, 20)).payload) == {"data": 10}
            speaker.publish({"data": -1})
            await looked.until(lambda: graph.node(Echo) is not first)
            speaker.publish({"data": 2})
            received = await looked.ask(listener.get, 20)
            assert kind.decode(received.payload) == {"data": 20}, "by a new instance with the parameters as they were"
            assert listener.lost == 0
        assert await looked.ask(ends, peer) == before
        lives = await looked.ask(peer.service, "/echo/lives")

        def asked():
            try:
                return peer.call(lives, {}, timeout_s=20)
            except ServiceError:  # it has just been restarting
                return None

        assert (await looked.ask(asked))["success"]
        gains = await looked.ask(peer.ask, "parameters", node="/echo")
        assert gains[0]["/echo"][0]["value"] == 10


class Lamp(Node):
    """A node beside it, which stays."""

    numbers = publisher(Int64, "numbers")


async def test_a_deleted_node_is_seen_no_more(looked_at):
    async with looked_at(Echo, Lamp) as looked:
        shown = await looked.ask(looked.peer.graph)
        assert {"/echo", "/lamp"} <= set(shown.nodes)
        await looked.graph.course.dismiss(["/echo"])
        async with asyncio.timeout(PATIENCE_S):
            while "/echo" in (shown := await looked.ask(looked.peer.graph)).nodes:
                pass  # its tokens are undeclared, and still on their way to this session
        assert "/lamp" in shown.nodes
        assert "/echoes" not in shown.topics, "which it alone had"
        assert "/numbers" in shown.topics
        assert not [token for token in looked.peer.tokens() if token.node_name == "/echo"]
        assert {topic.name for topic in looked.graph.report().topics} >= {"/echoes", "/numbers"}
