"""A graph that may be inspected has a directory while it runs, and runs all the same where it cannot have one."""

import os
from pathlib import Path

import pytest

import busflow
from busflow import Node, launch, publisher
from busflow.clock import SystemClock
from busflow.msgs.std_msgs import Int64
from busflow.wire.mirror.membership import Membership
from busflow.wire.zenoh.run_directory import RunCard, runs

pytestmark = pytest.mark.asyncio


class Talker(Node):
    numbers = publisher(Int64, "numbers")


async def test_a_graph_is_found_while_it_runs():
    begun_ns = SystemClock().now().nanoseconds
    async with launch(Talker, inspect="talk"):
        (run,) = runs()
        assert (run.name, run.card.pid, run.card.version) == ("talk", os.getpid(), busflow.__version__)
        assert begun_ns <= run.card.since_ns <= SystemClock().now().nanoseconds
        assert run.directory.stat().st_mode & 0o077 == 0, "the directory is its user's alone"
    assert runs() == []


async def test_without_a_directory_the_graph_runs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(tmp_path / "file"))
    async with launch(Talker, inspect="talk") as graph:
        graph.node(Talker).numbers.publish(Int64(data=1))
    assert "cannot be inspected: " in capsys.readouterr().err


async def test_the_barrier_exists_from_the_start_on(tmp_path: Path):
    membership = Membership(launch(Talker), tmp_path, RunCard("early", 1, 1), process="main", socket="main.sock")
    with pytest.raises(RuntimeError):
        _ = membership.barrier
