"""A node calls a server of another process as it calls one of its own."""

import asyncio
import os
import time

import pytest

from busflow import Node, ServiceGone, ServiceTimeout, ServiceUnavailable, client, launch
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.runner.extension import Extension
from busflow.wire.client.client import join
from busflow.wire.mirror.mirror import Mirror
from busflow.wire.zenoh.run_directory import RunCard, find_run
from busflow.wire.zenoh.session import open_session
from tests.wire.mirror.lamp import PATIENCE_S, two_are_withdrawn


class Hand(Node):
    """Asks a lamp that lives in another process."""

    switch = client(SetBool, "lamp/switch")
    never = client(Trigger, "lamp/never")


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
