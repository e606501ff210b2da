"""Services across processes: a real run in another process, asked by a peer and by the node of a graph here."""

import asyncio
import os
import time

import pytest

from busflow import Node, ServiceFailed, ServiceGone, ServiceTimeout, ServiceUnavailable, client, launch
from busflow.errors import MalformedMessage, NoSuchTarget
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.runner.extension import Extension
from busflow.wire.client.client import join
from busflow.wire.mirror.mirror import Mirror
from busflow.wire.zenoh.run_directory import RunCard, find_run
from busflow.wire.zenoh.session import open_session

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

SERVER = """
import asyncio

from busflow import Node, service
from busflow.msgs.std_srvs import SetBool, Trigger


class Lamp(Node):
    @service(SetBool, "~/switch")
    async def switch(self, request: SetBool.Request) -> SetBool.Response:
        if not request.data:
            raise ValueError("it stays on")
        return SetBool.Response(success=True, message="it is on")

    @service(Trigger, "~/never")
    async def never(self, request: Trigger.Request) -> Trigger.Response:
        await asyncio.Event().wait()
        return Trigger.Response()

    async def run(self) -> None:
        self.log.info("ready")
"""


class Hand(Node):
    """Asks a lamp that lives in another process."""

    switch = client(SetBool, "lamp/switch")
    never = client(Trigger, "lamp/never")


@pytest.fixture
def room(robots):
    return robots(SERVER, "room").ready()


@pytest.mark.usefixtures("room")
def test_a_peer_asks_and_is_answered():
    with join() as peer:
        switch = peer.service("/lamp/switch")
        assert switch.type == "std_srvs/srv/SetBool"
        assert peer.call(switch, {"data": True}, timeout_s=PATIENCE_S) == {"success": True, "message": "it is on"}


@pytest.mark.usefixtures("room")
def test_peer_gets_the_reason_without_an_answer():
    with join() as peer:
        switch = peer.service("/lamp/switch")
        with pytest.raises(ServiceFailed, match="it stays on"):
            peer.call(switch, {"data": False}, timeout_s=PATIENCE_S)
        with pytest.raises(MalformedMessage, match="did you mean 'data'"):
            peer.call(switch, {"dat": False}, timeout_s=PATIENCE_S)
        with pytest.raises(ServiceTimeout, match=r"within 0\.2 s"):
            peer.call(peer.service("/lamp/never"), {}, timeout_s=0.2)
        with pytest.raises(NoSuchTarget, match="/lamp/off"):
            peer.service("/lamp/off")


def two_are_withdrawn(peer):
    """Wait until of three requests those two are withdrawn that had not begun."""
    account = {}
    end = time.monotonic() + PATIENCE_S
    while account.get("withdrawn") != 2 and time.monotonic() < end:
        answers = peer.ask("services", names=["/lamp/never"])
        (account,) = [each for answer in answers for each in answer["/lamp/never"]["servers"]]
    return (account["received"], account["withdrawn"], account["waiting"]) == (3, 2, 1)


@pytest.mark.usefixtures("room")
def test_a_timed_out_request_is_withdrawn_before_handling():
    with join() as peer:
        never = peer.service("/lamp/never")
        for _ in range(3):
            with pytest.raises(ServiceTimeout):
                peer.call(never, {}, timeout_s=0.2)
        assert two_are_withdrawn(peer)


@pytest.mark.usefixtures("room")
def test_a_malformed_request_is_refused_alone():
    with join() as peer:
        switch = peer.service("/lamp/switch")
        key = f"0/lamp/switch/std_srvs::srv::dds_::SetBool_/{switch.hash}"
        (reply,) = peer.session.get(key, payload=b"\x00", timeout=PATIENCE_S)
        assert b"MalformedMessage" in reply.err.payload.to_bytes()
        assert peer.call(switch, {"data": True}, timeout_s=PATIENCE_S)["success"]


@pytest.mark.usefixtures("room")
def test_the_graph_of_a_run_shows_its_services():
    with join() as peer:
        services = peer.graph().services
        assert [(name, each.type) for name, each in services.items()] == [
            ("/lamp/never", "std_srvs/srv/Trigger"),
            ("/lamp/switch", "std_srvs/srv/SetBool"),
        ]
        assert [end.node for end in services["/lamp/switch"].publishers] == ["/lamp"]


class Shown(Extension):
    """A graph that shows itself to the run from when it starts."""

    def __init__(self, mirror):
        self.begin = mirror.begin


def ask_from_another_process(conversation):
    """Run `conversation(hand)` in a graph of this process that is part of the run."""

    async def main():
        graph = launch(Hand)
        session = open_session(find_run().directory, listen="second.sock")
        mirror = Mirror(graph, session, RunCard("second", os.getpid(), time.time_ns()), "second", {})
        graph.attach(Shown(mirror))
        try:
            async with asyncio.timeout(PATIENCE_S), graph:
                hand = graph.node(Hand)
                await hand.switch.ready(timeout=PATIENCE_S)
                await hand.never.ready(timeout=PATIENCE_S)
                await conversation(hand)
        finally:
            mirror.close()

    asyncio.run(main())


@pytest.mark.usefixtures("room")
def test_a_node_asks_a_node_of_another_process():
    async def conversation(hand):
        response = await hand.switch.call(SetBool.Request(data=True))
        assert response == SetBool.Response(success=True, message="it is on")
        with pytest.raises(ServiceFailed, match="it stays on"):
            await hand.switch.call(SetBool.Request(data=False))
        with pytest.raises(ServiceTimeout):
            await hand.never.call(Trigger.Request(), timeout=0.2)

    ask_from_another_process(conversation)


@pytest.mark.usefixtures("room")
def test_abandoned_request_is_withdrawn_at_the_server():
    async def conversation(hand):
        for _ in range(3):
            with pytest.raises(ServiceTimeout):
                await hand.never.call(timeout=0.2)
        with join() as peer:
            assert await asyncio.to_thread(two_are_withdrawn, peer)

    ask_from_another_process(conversation)


def test_a_killed_server_fails_pending_calls_at_once(room):
    async def conversation(hand):
        asyncio.get_running_loop().call_soon(room.process.kill)
        with pytest.raises(ServiceGone, match="/lamp"):
            await hand.never.call(Trigger.Request(), timeout=PATIENCE_S)
        # Until its token is gone as well the server is there, and cannot be reached.
        with pytest.raises((ServiceGone, ServiceUnavailable), match="/lamp/switch"):
            await hand.switch.call(SetBool.Request())

    ask_from_another_process(conversation)
