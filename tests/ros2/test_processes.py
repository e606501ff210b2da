"""A run of several processes: nodes of ROS 2 reach those of every process, and none of them opens more than it says."""

import asyncio
import json
import queue
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from busflow import SENSOR_DATA, Node, launch, subscription
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_srvs import Trigger
from tests.ros2.rmw_node import RmwNode
from tests.ros2.sessions import PATIENCE_S, arrived, free_port, rmw_session, ros2_at

LAB = Path(__file__).parents[2] / "configs/lab1_processes.yaml"


@pytest.fixture
def port(tmp_path: Path) -> Iterator[int]:
    """The lab in two processes, with the port at which nodes of ROS 2 find it."""
    found = free_port()
    file = tmp_path / "lab.yaml"
    ros2 = {"domain": 7, "router": f"tcp/127.0.0.1:{found}"}
    file.write_text(f"include: {LAB}\nnetwork: {{ros2: {json.dumps(ros2)}}}\n")
    command = [sys.executable, "-m", "busflow", "run", str(file)]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
    assert process.stderr is not None
    for line in process.stderr:
        if "All sensors operational" in line:
            break
    yield found
    process.send_signal(signal.SIGINT)
    rest = process.stderr.read()
    process.stderr.close()
    assert process.wait(PATIENCE_S) == 130, rest
    assert "Traceback" not in rest


class Listener(Node):
    async def start(self) -> None:
        self.heard: asyncio.Queue[str] = asyncio.Queue()

    @subscription("imu/data", qos=SENSOR_DATA)
    async def on_imu(self, imu: Imu) -> None:
        await self.heard.put(imu.header.frame_id)


@pytest.mark.long
@pytest.mark.asyncio
async def test_another_run_receives_from_every_process(port: int):
    async with launch(ros2_at(port), Listener, inspect="second") as graph:
        assert await arrived(graph.node(Listener).heard)


@pytest.mark.long
def test_nodes_of_all_processes_are_seen_and_called(port: int):
    with rmw_session(port) as session:
        ros = RmwNode(session, "ros")
        tokens = [ros.sees("/NN/", name) for name in ("/sensor_publisher", "/sensor_processor")]
        assert len({token.split("/")[2] for token in tokens}) == 2, "each process has a session of its own"
        received: queue.Queue[Any] = queue.Queue()
        imu = TypeSupport(Imu)
        ros.subscription("/imu/data", imu, received.put)
        sample = received.get(timeout=PATIENCE_S)
        assert imu.decode(sample.payload.to_bytes()).header.frame_id
        ros.sees("/SS/", "%sensor_publisher%reset")
        request = TypeSupport(Trigger.Request).encode(Trigger.Request())
        answer, *_ = ros.call("/sensor_publisher/reset", TypeSupport(Trigger), request)
        assert TypeSupport(Trigger.Response).decode(answer).success
