"""A session that the run would take for this user's, if it were linked by a Unix socket, gets no further than ROS 2."""

import asyncio
import sys
from pathlib import Path

import pytest

from busflow import Node, launch, publisher, subscription, timer
from busflow.msgs.std_msgs import String
from tests.ros2.sessions import PATIENCE_S, ROUTER, free_port, opened, ros2_at


class Robot(Node):
    chatter = publisher(String, "chatter")
    secret = publisher(String, "secret")

    async def start(self) -> None:
        self.heard: asyncio.Queue[str] = asyncio.Queue()
        self.orders: list[str] = []

    @timer(0.05)
    def on_tick(self) -> None:
        self.secret.publish(String(data="x"))
        self.chatter.publish(String(data="x"))

    @subscription("order")
    def on_order(self, order: String) -> None:
        self.orders.append(order.data)

    @subscription("said")
    async def on_said(self, said: String) -> None:
        await self.heard.put(said.data)


@pytest.mark.asyncio
@pytest.mark.parametrize(
    ("zid", "also"), [("1", ()), ("f" * 32, ("tcp/localhost:0",))], ids=["it waits for the run", "it connects"]
)
async def test_a_foreign_unix_socket_gives_no_rights(zid: str, also: tuple[str, ...], directory: Path):
    port, received = free_port(), list[str]()
    command = [sys.executable, "-m", "tests.ros2.trespasser", str(port), str(directory / "own.sock"), zid, *also]
    with opened(ROUTER | {"listen/endpoints": [f"tcp/127.0.0.1:{port}"]}):
        async with launch(ros2_at(port, topics=("/chatter", "/said")), Robot, inspect="ros") as graph:
            process = await asyncio.create_subprocess_exec(*command, stdout=asyncio.subprocess.PIPE)
            try:
                async with asyncio.timeout(PATIENCE_S):
                    while sum("/chatter/" in line for line in received) < 5:
                        received.append((await process.stdout.readuntil(b"\n")).decode())  # an error at its end
                    for _ in range(3):
                        await graph.node(Robot).heard.get()
            finally:
                process.kill()
                rest, _ = await process.communicate()
            assert not [line for line in (*received, *rest.decode().splitlines()) if "/chatter/" not in line]
            assert graph.node(Robot).orders == []
