"""Nodes of ROS 2 that others have written take part in a run: topics and services, in both directions."""

import asyncio
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from busflow import Message, Node, client, launch, publisher, service, subscription
from busflow.interfaces.message import UInt8Array
from busflow.msgs.example_interfaces import AddTwoInts
from busflow.msgs.std_msgs import String
from busflow.wire.client.client import join
from busflow.wire.client.graph_view import GraphView
from tests.ros2.sessions import PATIENCE_S, arrived, free_port, ros2_at, until_arrived

SIX_MB = 6 * 1024 * 1024
PICTURE = np.zeros(SIX_MB, np.uint8)
PICTURE[-1] = 7


class Blob(Message, package="lab"):
    data: UInt8Array


class Robot(Node):
    chatter, picture = publisher(String, "chatter"), publisher(Blob, "picture")
    add_there = client(AddTwoInts, "/sdk/add")

    async def start(self) -> None:
        self.arrived: asyncio.Queue[Any] = asyncio.Queue()

    @subscription("/said")
    async def on_said(self, said: String) -> None:
        await self.arrived.put(said.data)

    @subscription("/seen")
    async def on_seen(self, seen: Blob) -> None:
        await self.arrived.put((len(seen.data), int(seen.data[-1])))

    @service(AddTwoInts, "/robot/add")
    async def add(self, request: AddTwoInts.Request) -> AddTwoInts.Response:
        return AddTwoInts.Response(sum=request.a + request.b)


class SdkNode:
    """The process of `sdk_node.py`."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.process = process
        self.arrived: asyncio.Queue[Any] = asyncio.Queue()
        self.reading = asyncio.create_task(self._read())

    async def _read(self) -> None:
        while line := await self.process.stdout.readline():
            if line.startswith(b"["):
                await self.arrived.put(json.loads(line))

    def tell(self, *words: Any) -> None:
        self.process.stdin.write(json.dumps(words).encode() + b"\n")


def look(run: str) -> GraphView:
    """What another terminal sees of a run."""
    with join(run) as peer:
        return peer.graph()


@pytest.mark.asyncio
async def test_topics_and_services_reach_both_sides():
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="sdk") as graph:
        robot = graph.node(Robot)
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, Path(__file__).with_name("sdk_node.py"), str(port)),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
        )
        try:
            node = SdkNode(process)
            assert (await arrived(node.arrived))[0] == "ready"
            await until_arrived(lambda: node.tell("publish", "/said", "hello"), robot.arrived, "hello")
            said = ["received", "/chatter", "hi"]
            await until_arrived(lambda: robot.chatter.publish(String(data="hi")), node.arrived, said)
            assert (await robot.add_there.call(AddTwoInts.Request(a=2, b=3), timeout=PATIENCE_S)).sum == 5
            await until_arrived(lambda: node.tell("call", 20, 22), node.arrived, ["answer", 42])
            shown = ["received", "/picture", [SIX_MB, 7]]
            await until_arrived(lambda: robot.picture.publish(Blob(data=PICTURE)), node.arrived, shown)
            await until_arrived(lambda: node.tell("publish_bytes", "/seen", SIX_MB), robot.arrived, (SIX_MB, 7))
            seen = await asyncio.to_thread(look, "sdk")
            assert {"/sdk/talker", "/sdk/listener", "/sdk/adder", "/sdk/asker", "/robot"} <= set(seen.nodes)
            assert {"/said", "/chatter"} <= set(seen.topics)
            assert {"/sdk/add", "/robot/add"} <= set(seen.services)
        finally:
            process.kill()
            await process.wait()
