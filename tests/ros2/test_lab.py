"""The lab with one half on busflow and the other on a raw Zenoh session, joined by one line of a launch file."""

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from busflow import launch
from busflow.msgs.std_msgs import Float64
from tests.ros2.sessions import PATIENCE_S, free_port, until

ROOT = Path(__file__).parents[2]
LAB = f"""
plugins: [{ROOT}/plugins]
network: {{ros2: {{domain: 7, router: "tcp/127.0.0.1:PORT"}}}}
nodes:
  HALF: {{plugin: HALF}}
"""


@asynccontextmanager
async def lab(tmp_path: Path, half: str, other: str) -> AsyncIterator[tuple[object, asyncio.StreamReader]]:
    """A half of the lab on busflow, and the output of the other one."""
    port, file = free_port(), tmp_path / "half.yaml"
    file.write_text(LAB.replace("HALF", half).replace("PORT", str(port)))
    async with launch(file, inspect="lab") as graph:
        command = [sys.executable, "-m", "tests.ros2.lab", str(port), other]
        process = await asyncio.create_subprocess_exec(*command, stdout=asyncio.subprocess.PIPE, cwd=ROOT)
        try:
            async with asyncio.timeout(PATIENCE_S):
                yield graph, process.stdout
        finally:
            process.kill()
            await process.wait()


@pytest.mark.long
@pytest.mark.asyncio
async def test_processor_of_ros2_works_on_sensors_of_busflow(tmp_path: Path):
    async with lab(tmp_path, "sensor_publisher", "processor") as (graph, output):
        assert await output.readline() == b"joints 10\n"
        async for balance in graph.subscribe(Float64, "balance_state"):
            assert 0 < balance.data <= 1
            break


@pytest.mark.long
@pytest.mark.asyncio
async def test_processor_of_busflow_works_on_sensors_of_ros2(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    async with lab(tmp_path, "sensor_processor", "sensors") as (graph, output):
        assert await output.readline() == b"balance 0.25\n"
        async for stability in graph.subscribe(Float64, "stability_index"):
            assert stability.data == 0.75
            break
        await until(lambda: "All sensors operational" in capsys.readouterr().err)
