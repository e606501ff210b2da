"""`busflow bag snapshot`: the last moments of a run, asked for from another terminal."""

import asyncio
import json

import pytest

from busflow import Node, launch, publisher, timer
from busflow.cli import main
from busflow.errors import ExitCode
from busflow.msgs.std_msgs import Int64
from busflow.recording.bag.bag import Bag


class Source(Node):
    counted = publisher(Int64, "/count")
    count = 0

    @timer(hz=100)
    def tick(self) -> None:
        self.count += 1
        self.counted.publish(Int64(data=self.count))


@pytest.mark.asyncio
async def test_a_snapshot_from_outside_is_awaited(tmp_path, capsys, golden):
    record = {"to": str(tmp_path / "{name}.mcap"), "snapshot": 10, "after": "100ms"}
    async with launch(Source, inspect="shot", record=record):
        for number in (1, 2):
            command = ["bag", "snapshot", "--run", "shot", "--reason", f"look {number}", "--json"]
            assert await asyncio.to_thread(main, command) == 0
            found = json.loads(capsys.readouterr().out)
            assert found["path"] == str(tmp_path / f"graph-00{number}.mcap")
            with Bag(found["path"]) as bag:
                assert bag.complete
                assert bag.series[0].reason == f"look {number}"
                assert bag.messages == found["recorded"] > 5
        assert await asyncio.to_thread(main, ["bag", "snapshot", "--run", "shot"]) == 0
        golden(capsys.readouterr().out, mask={r".*(graph-003)": r"\1", r"\b\d+(\.\d+)? ": "# "})


@pytest.mark.asyncio
async def test_a_run_that_keeps_nothing_says_so(capsys, golden):
    async with launch(Source, inspect="bare"):
        assert await asyncio.to_thread(main, ["bag", "snapshot", "--run", "bare"]) == ExitCode.NOT_FOUND
    golden(capsys.readouterr().err)
