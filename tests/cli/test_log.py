"""`busflow log`: the last lines of a run, and those that follow until it ends."""

import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main

Captured = pytest.CaptureFixture[str]


@pytest.mark.usefixtures("lab")
class TestKeptLines:
    def test_they_are_shown_as_the_run_wrote_them_and_steer_no_terminal(self, capsys: Captured):
        assert main(["log"]) == 0
        out = capsys.readouterr().out
        (line,) = (line for line in out.splitlines() if "/processor: works" in line)
        assert line.endswith(r" info     /processor: works path=\x1b[31m")

    def test_node_and_level_choose_among_them(self, capsys: Captured):
        assert main(["log", "--node", "processor"]) == 0
        assert len(capsys.readouterr().out.splitlines()) == 1
        assert main(["log", "--node", "processor", "--level", "warning"]) == 0
        assert capsys.readouterr().out == ""
        assert main(["log", "-n", "0"]) == 0
        assert capsys.readouterr().out == ""

    def test_json_is_one_object_a_line(self, capsys: Captured):
        assert main(["log", "--node", "/processor", "--json"]) == 0
        told = json.loads(capsys.readouterr().out)
        assert (told["version"], told["level"], told["node"]) == (1, 20, "/processor")
        assert told["text"] == r"works path=\x1b[31m"
        assert told["stamp_ns"] > 1_700_000_000 * 10**9

    def test_a_node_that_is_not_there_is_told_with_the_nearest(self, capsys: Captured):
        assert main(["log", "--node", "procesor"]) == 4
        assert "did you mean '/processor'?" in capsys.readouterr().err


@pytest.mark.e2e
def test_following_goes_on_to_the_last_line_and_ends_with_the_run(
    project: Path, start_run: Callable[..., Any], place: Any
):
    run = start_run(project, "talk.yaml", "--set", "nodes.talker.parameters.fail_at=200")
    run.wait_for("heard")
    command = [sys.executable, "-m", "busflow", "log", "-f", "-n", "1"]
    done = subprocess.run(command, capture_output=True, text=True, env=place.environment, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    heard = [line.partition("number=")[2] for line in done.stdout.splitlines() if "/listener: heard" in line]
    assert heard == [f"{number}.0" for number in range(int(float(heard[0])), 200)], "none is missing, none comes twice"
    assert r"/talker: failed in Talker.talk (timer): ValueError: \x1b[31mlost count" in done.stdout.splitlines()[-1]
