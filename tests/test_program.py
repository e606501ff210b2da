"""Tests of `program.py`: `run` in this process returns the exit code, and `launch` returns a graph to enter."""

from __future__ import annotations

import asyncio

import pytest

import busflow
from busflow import LaunchError, Node, publisher
from busflow.errors import ExitCode, NotRunning, ProgramFailed
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time


class Failing(Node):
    async def start(self) -> None:
        raise ValueError("no sensor")


class Counting(Node):
    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.numbers.publish(Int64(data=1))


def test_run_prints_a_failure_and_returns_its_code(capsys):
    assert busflow.run(Failing, inspect=False) is ExitCode.FAILED
    shown = capsys.readouterr().err
    assert "error: node /failing failed" in shown
    assert "ValueError: no sensor" in shown


@virtual_time
async def test_run_in_a_notebook_names_launch(golden):
    with golden.raises(NotRunning):
        busflow.run(Counting, inspect=False)


@virtual_time
async def test_start_returns_the_graph():
    graph = busflow.launch(Counting)
    assert await graph.start() is graph
    await graph.stop()


def test_run_refuses_a_graph_that_cannot_run():
    with pytest.raises(LaunchError) as caught:
        busflow.run(Counting, Counting, inspect=False)
    assert [each.code for each in caught.value.problems] == ["duplicate-node"]


def test_run_without_arguments_is_refused(golden):
    with golden.raises(LaunchError):
        busflow.run(inspect=False)


def test_launch_runs_nodes_in_the_running_loop(capsys):
    async def main():
        async with busflow.launch(Counting) as graph:
            return [topic.published for topic in graph.bus.topics.values() if topic.name == "/numbers"]

    assert asyncio.run(main()) == [1]
    assert "in this process" not in capsys.readouterr().err


@pytest.mark.parametrize("clock", ["", "clock: {mode: follow}\n"], ids=["system time", "follows /clock"])
def test_run_starts_each_program_once(tmp_path, capfd, clock):
    file = tmp_path / "run.yaml"
    file.write_text(f"{clock}programs: {{driver: {{command: [echo, hello]}}}}")
    assert busflow.run(file, inspect=False) is ExitCode.OK
    assert capfd.readouterr().err.count("/driver: hello") == 1


def test_failed_program_ends_block_of_launch(tmp_path, golden):
    file = tmp_path / "run.yaml"
    file.write_text("programs: {driver: {command: [sh, -c, exit 3]}}")

    async def block() -> None:
        async with asyncio.timeout(60), busflow.launch(file):
            await asyncio.Event().wait()

    with golden.raises(ProgramFailed):
        asyncio.run(block())
