"""A bridge serves a run of this process to viewers that speak the protocol."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, closing
from typing import Any

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.asyncio.server import serve

from busflow import Node, publisher, service
from busflow.errors import NoSuchTarget
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger
from busflow.wire.client.client import Peer
from busflow.wire.zenoh.run_directory import find_run
from busflow_ui.foxglove.bridge import Bridge, Terms
from tests.golden import Golden

pytestmark = pytest.mark.asyncio
LOOKING = ["parameters", "parametersSubscribe", "connectionGraph"]


class Counter(Node):
    numbers = publisher(Int64, "numbers")

    @service(Trigger, "reset")
    def on_reset(self, _: Trigger.Request) -> Trigger.Response:
        return Trigger.Response()


@asynccontextmanager
async def bridged(looked: Any, terms: Terms) -> AsyncIterator[tuple[Bridge, ClientConnection, list[str]]]:
    """A bridge to the run, a viewer of it, and the lines that it prints."""
    printed: list[str] = []
    with closing(await looked.ask(Bridge, looked.peer, print_message=printed.append)) as bridge:
        async with (
            asyncio.timeout(60),
            serve(lambda connection: bridge.serve(connection, terms), "127.0.0.1", 0) as server,
            connect(f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}") as viewer,
        ):
            yield bridge, viewer, printed


async def until(viewer: ClientConnection, holds: Callable[[Any], bool]) -> Any:
    """Receive until a message is so."""
    while True:
        message = await viewer.recv()
        if isinstance(message, str) and holds(found := json.loads(message)):
            return found


@pytest.mark.parametrize("read_only", [True, False])
async def test_viewer_is_offered_what_its_terms_allow(looked_at: Any, read_only: bool):
    terms = Terms(read_only=read_only, capabilities=("more",), metadata={"a": "b"})
    async with looked_at(Counter) as looked, bridged(looked, terms) as (_, viewer, printed):
        info = json.loads(await viewer.recv())
        topics = await until(viewer, lambda each: each["op"] == "advertise")
        if not read_only:
            services = await until(viewer, lambda each: each["op"] == "advertiseServices")
            assert "/reset" in [each["name"] for each in services["services"]]
    assert (info["op"], info["name"]) == ("serverInfo", "busflow: looked")
    assert info["capabilities"] == [*LOOKING, *([] if read_only else ["clientPublish", "services"]), "more"]
    assert info["metadata"]["a"] == "b"
    assert "/numbers" in [each["topic"] for each in topics["channels"]]
    assert [line.split()[-1] for line in printed] == ["come", "gone"]


async def test_viewers_see_topics_come_and_go(looked_at: Any):
    async with looked_at(Counter) as looked, bridged(looked, Terms(read_only=True)) as (bridge, viewer, _):
        ended = asyncio.create_task(bridge.ended())
        await until(viewer, lambda each: each["op"] == "advertise")
        other = await looked.ask(lambda: Peer(find_run("looked")))
        try:
            with other.advertise("/late", await looked.ask(looked.peer.type, "std_msgs/msg/Int64"), settle=False):
                (channel,) = (await until(viewer, lambda each: each["op"] == "advertise"))["channels"]
        finally:
            await looked.ask(other.close)
        gone = await until(viewer, lambda each: each["op"] == "unadvertise")
        ended.cancel()
    assert (channel["topic"], gone["channelIds"]) == ("/late", [channel["id"]])


async def test_bridge_ends_with_its_run(looked_at: Any, golden: Golden):
    async with looked_at(Counter) as looked, bridged(looked, Terms(read_only=True)) as (bridge, viewer, _):
        ended = asyncio.create_task(bridge.ended())
        await until(viewer, lambda each: each["op"] == "advertise")
        await bridge.next_look()
        assert not ended.done()
        looked.graph.ask_to_stop()
        await looked.graph.wait()
        await ended
        await bridge.announce_end()
        status = await until(viewer, lambda each: each["op"] == "status")
    golden(status["message"])


async def test_unmatched_topics_are_refused_at_once(looked_at: Any, golden: Golden):
    async with looked_at(Counter) as looked:
        with golden.raises(NoSuchTarget):
            await looked.ask(Bridge, looked.peer, ["absent"], print_message=print)
