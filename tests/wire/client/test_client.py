"""A client of a run asks its processes, finds types and services, receives, and calls.

Tests of `actions.py` are those of the command that sends goals, `tests/cli/test_action.py`.
"""

import asyncio
import threading
from dataclasses import replace
from typing import Any

import pytest

from busflow import Node, publisher, service
from busflow.errors import NoSuchTarget, ServiceTimeout
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import SetBool
from busflow.wire.client.client import Peer, join
from busflow.wire.client.runs import ask_peer
from busflow.wire.zenoh.keys import TokenKind
from busflow.wire.zenoh.run_directory import find_run

pytestmark = pytest.mark.asyncio


class Counter(Node):
    numbers = publisher(Int64, "numbers")

    @service(SetBool, "~/set")
    def on_set(self, request: SetBool.Request) -> SetBool.Response:
        return SetBool.Response(success=request.data, message="set")


async def test_silence_of_the_main_process_is_said_once(looked_at: Any):
    async with looked_at(Counter) as looked:
        peer, texts = looked.peer, list[str]()
        peer.on_silence = texts.append
        await looked.ask(peer.ask, "graph")
        assert texts == []
        peer.run = replace(peer.run, card=replace(peer.run.card, main_process="planner"))  # as if it had another name
        for _ in range(2):
            await looked.ask(peer.ask, "graph")
        (text,) = texts
        assert " process of looked " in text
        present = await looked.ask(ask_peer, peer)
        assert (present.state, present.nodes, present.silence) == ("does not answer", None, text)


async def test_a_refused_question_raises(looked_at: Any):
    async with looked_at(Counter) as looked:
        with pytest.raises(NoSuchTarget, match="/absent"):
            await looked.ask(looked.peer.ask, "set_parameters", node="/absent", values={"a": 1})


async def test_a_client_sees_others_and_not_itself(looked_at: Any):
    async with looked_at(Counter) as looked:
        numbers = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        with looked.peer.advertise("/mine", numbers, settle=False):
            own = {token.topic for token in await looked.ask(looked.peer.tokens)}
            other = await looked.ask(lambda: Peer(find_run("looked")))
            try:
                tokens, _ = await looked.ask(other.look)
            finally:
                await looked.ask(other.close)
    assert "/numbers" in own
    assert "/mine" not in own
    assert "/mine" in {token.topic for token in tokens if token.kind is TokenKind.PUBLISHER}


async def test_an_unused_type_is_unknown(looked_at: Any):
    async with looked_at(Counter) as looked:
        with pytest.raises(NoSuchTarget, match="std_msgs/msg/Bool"):
            await looked.ask(looked.peer.type, "std_msgs/msg/Bool")
        known = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        with pytest.raises(NoSuchTarget):
            await looked.ask(looked.peer.type, "std_msgs/msg/Int64", known.type_hash[:-1] + "x")


async def test_the_listener_wakes_on_arrival(looked_at: Any):
    async with looked_at(Counter) as looked:
        arrived = threading.Event()
        topic = (await looked.ask(looked.peer.graph)).topic("numbers")
        numbers = await looked.ask(looked.peer.type, "std_msgs/msg/Int64")
        with looked.peer.listen(topic, numbers, on_arrival=arrived.set) as listener:
            await looked.ask(looked.peer.settle)
            looked.graph.node(Counter).numbers.publish(Int64(data=5))
            assert await looked.ask(arrived.wait, 60)
            assert numbers.decode(listener.get(0).payload) == {"data": 5}


async def test_a_blocked_server_times_out(looked_at: Any):
    async with looked_at(Counter) as looked:
        found = await looked.ask(looked.peer.service, "/counter/set")
        with pytest.raises(ServiceTimeout, match="/counter/set"):
            looked.peer.call(found, {"data": True}, timeout_s=0.05)  # on the loop's own thread, which it blocks


async def test_joining_ends_with_the_block(looked_at: Any):
    async with looked_at(Counter):

        def look() -> Peer:
            with join("looked") as peer:
                assert peer.alive
            return peer

        assert (await asyncio.to_thread(look)).session.is_closed()
