"""Nodes of ROS 2 whose process is killed or hangs: what they had is gone, callers get their error, and they return."""

import asyncio
import signal
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest

from busflow import Durability, Node, QoS, ServiceGone, client, launch, subscription
from busflow.cli import main
from busflow.msgs.example_interfaces import AddTwoInts
from busflow.msgs.std_msgs import Int64
from tests.ros2.sessions import PATIENCE_S, arrived, free_port, ros2_at, until

AT_ONCE_S = 30.0
"""The end of a killed process's link is known at once; only one that hangs is known after the lease of `rmw_zenoh`."""
ROOT = Path(__file__).parents[2]


class Robot(Node):
    add = client(AddTwoInts, "/camera/add")

    async def start(self) -> None:
        self.arrived: asyncio.Queue[Any] = asyncio.Queue()

    @subscription("/plan", qos=QoS(depth=5, durability=Durability.TRANSIENT_LOCAL))
    async def on_plan(self, plan: Int64) -> None:
        await self.arrived.put(plan.data)


@asynccontextmanager
async def camera(port: int, *, lease_ms: int = 60_000) -> AsyncIterator[asyncio.subprocess.Process]:
    """The process of `ros_process.py`; it is killed at the end of the block."""
    arguments = ["-m", "tests.ros2.ros_process", str(port), str(lease_ms)]
    process = await asyncio.create_subprocess_exec(sys.executable, *arguments, cwd=ROOT)
    try:
        yield process
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()


LISTED = {
    "node list": "/camera\n",
    "topic info -v /plan": "Node name: camera\n",
    "service info /camera/add": "Services count: 1",
}
"""Commands, and what they say while the camera is there."""


async def listed(capsys: pytest.CaptureFixture[str]) -> list[bool]:
    """Whether each command shows the camera."""
    found: list[bool] = []
    for command, words in LISTED.items():
        assert await asyncio.to_thread(main, [*command.split(), "--run", "killed"]) == 0
        found.append(words in capsys.readouterr().out)
    return found


async def works(robot: Robot) -> None:
    """Wait until the camera's plan has arrived and its service answers."""
    assert await arrived(robot.arrived) == 7
    await robot.add.ready(timeout=PATIENCE_S)
    assert (await robot.add.call(AddTwoInts.Request(a=0, b=0), timeout=PATIENCE_S)).sum == 0


@pytest.mark.long
@pytest.mark.asyncio
async def test_a_killed_node_is_gone_and_returns(capsys: pytest.CaptureFixture[str]):
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="killed") as graph:
        robot, topic = graph.node(Robot), graph.bus.topics["/plan"]
        for _ in range(2):
            async with camera(port) as process:
                await works(robot)
                assert await listed(capsys) == [True, True, True]
                calling = asyncio.create_task(robot.add.call(AddTwoInts.Request(a=1, b=1), timeout=PATIENCE_S))
                await until(lambda: graph.bus.services["/camera/add"].clients[0].statistics().waiting)
                process.kill()
                async with asyncio.timeout(AT_ONCE_S):
                    with pytest.raises(ServiceGone, match="/camera/add: "):
                        await calling
                await until(lambda: not topic.publishers)
                assert not robot.add.available
                assert await listed(capsys) == [False, False, False]
        assert not topic.losses


@pytest.mark.long
@pytest.mark.asyncio
async def test_a_stopped_node_is_gone_until_continued():
    port = free_port()
    async with launch(ros2_at(port), Robot, inspect="killed") as graph:
        robot = graph.node(Robot)
        async with camera(port, lease_ms=3000) as process:  # on a busy machine a second may pass without a sign
            await works(robot)
            calling = asyncio.create_task(robot.add.call(AddTwoInts.Request(a=1, b=1), timeout=PATIENCE_S))
            process.send_signal(signal.SIGSTOP)
            with pytest.raises(ServiceGone):
                await calling
            await until(lambda: not robot.add.available)
            process.send_signal(signal.SIGCONT)
            await robot.add.ready(timeout=PATIENCE_S)
            assert (await robot.add.call(AddTwoInts.Request(a=0, b=0), timeout=PATIENCE_S)).sum == 0
            assert robot.arrived.empty(), "a message that has arrived is not published again"
