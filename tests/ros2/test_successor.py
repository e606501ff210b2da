"""A run takes the place of a router of ROS 2, or of another run, that has ended or was killed."""

import asyncio
import json
import signal
import socket
import sys
import threading
from pathlib import Path

import pytest

from busflow import launch
from busflow.clock import SystemClock
from busflow.launchfile.model.network import NetworkAddress
from busflow.launchfile.yaml.value import Origin, StatedBy
from busflow.log import Log
from busflow.ros2.successor import RouterSuccessor
from tests.ros2.sessions import ROUTER, free_port, opened, rmw_session, ros2_at, until
from tests.ros2.test_router import Robot, talk

ROOT = Path(__file__).parents[2]


async def talk_to_a_newcomer(port: int, robot: Robot) -> None:
    """One message each way with a session of ROS 2 that comes now."""
    coming = rmw_session(port)
    session = await asyncio.to_thread(coming.__enter__)  # it waits for the router, which the loop opens
    try:
        assert len(list(session.info.routers_zid())) == 1
        await talk(session, robot)
    finally:
        await asyncio.to_thread(coming.__exit__, None, None, None)


@pytest.mark.asyncio
async def test_the_run_takes_an_ended_routers_place(capsys: pytest.CaptureFixture[str]):
    port = free_port()
    with opened(ROUTER | {"listen/endpoints": [f"tcp/127.0.0.1:{port}"]}) as router:
        async with launch(ros2_at(port), Robot, inspect="ros") as graph:
            await talk_to_a_newcomer(port, graph.node(Robot))
            router.close()
            await talk_to_a_newcomer(port, graph.node(Robot))
    assert f" place at tcp/127.0.0.1:{port}" in capsys.readouterr().err
    assert not can_be_reached(port)


@pytest.mark.asyncio
async def test_a_name_is_resolved_in_a_thread(monkeypatch: pytest.MonkeyPatch):
    asked: list[threading.Thread] = []

    def resolve(*_arguments: object, **_words: object) -> object:
        asked.append(threading.current_thread())
        raise socket.gaierror

    router = NetworkAddress("tcp", "robot.example", 7447, Origin(StatedBy.CALLER))
    monkeypatch.setattr(socket, "getaddrinfo", resolve)
    async with RouterSuccessor(router, SystemClock(), Log(SystemClock()).bind("busflow")).surround():
        await until(lambda: asked)
    assert asked != [threading.main_thread()]


def can_be_reached(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.mark.long
@pytest.mark.asyncio
@pytest.mark.parametrize("end", [signal.SIGINT, signal.SIGKILL])
async def test_another_run_takes_an_ended_runs_place(end: signal.Signals, tmp_path: Path):
    port, file = free_port(), tmp_path / "first.yaml"
    ros2 = {"domain": 7, "router": f"tcp/127.0.0.1:{port}"}
    file.write_text(f"include: {ROOT / 'configs/lab1.yaml'}\nnetwork: {{ros2: {json.dumps(ros2)}}}\n")
    command = [sys.executable, "-m", "busflow", "run", str(file)]
    process = await asyncio.create_subprocess_exec(*command, stderr=asyncio.subprocess.PIPE)
    try:
        while b"stands in for their router" not in await process.stderr.readline():
            pass
        async with launch(ros2_at(port), Robot, inspect="second") as graph:
            await talk_to_a_newcomer(port, graph.node(Robot))
            process.send_signal(end)
            await process.communicate()
            await talk_to_a_newcomer(port, graph.node(Robot))
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
