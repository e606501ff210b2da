"""A node calls a server of another process as it calls one of its own."""

import asyncio
from contextlib import asynccontextmanager

import pytest

from busflow import Node, ServiceGone, ServiceTimeout, ServiceUnavailable, client
from busflow.msgs.std_srvs import SetBool, Trigger
from busflow.wire.client.client import join
from tests.wire.mirror.lamp import two_are_withdrawn
from tests.wire.mirror.processes import PATIENCE_S, second_process

pytestmark = pytest.mark.asyncio


class Hand(Node):
    """Asks a lamp that lives in another process."""

    switch = client(SetBool, "lamp/switch")
    never = client(Trigger, "lamp/never")


@asynccontextmanager
async def hand_of_another_process():
    async with second_process(Hand) as (graph, _):
        hand = graph.node(Hand)
        await hand.switch.ready(timeout=PATIENCE_S)
        await hand.never.ready(timeout=PATIENCE_S)
        yield hand


@pytest.mark.usefixtures("room")
async def test_abandoned_request_is_withdrawn_at_the_server():
    async with hand_of_another_process() as hand:
        for _ in range(3):
            with pytest.raises(ServiceTimeout):
                await hand.never.call(timeout=0.2)
        with join() as peer:
            assert await asyncio.to_thread(two_are_withdrawn, peer)


async def test_a_killed_server_fails_pending_calls_at_once(room):
    async with hand_of_another_process() as hand:
        asyncio.get_running_loop().call_soon(room.process.kill)
        with pytest.raises(ServiceGone, match="/lamp"):
            await hand.never.call(Trigger.Request(), timeout=PATIENCE_S)
        # Until its token is gone as well the server is there, and cannot be reached.
        with pytest.raises((ServiceGone, ServiceUnavailable), match="/lamp/switch"):
            await hand.switch.call(SetBool.Request())
