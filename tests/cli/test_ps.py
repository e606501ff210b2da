"""`busflow ps`: lists runs, and those that do not answer."""

import json
import os
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import busflow
from busflow.cli import main

Captured = pytest.CaptureFixture[str]
BLOCKER = '''
import time

from busflow import Node


class Blocker(Node):
    """Blocks the loop."""

    async def run(self) -> None:
        self.log.warning("blocks")
        time.sleep(30)
'''


@pytest.mark.usefixtures("lab")
def test_run_has_file_process_age_and_state(capsys: Captured):
    assert main(["ps"]) == 0
    head, row = capsys.readouterr().out.splitlines()
    assert head.split() == ["RUN", "FILE", "PID", "SINCE", "AGE", "NODES", "STATE"]
    assert row.split()[0] == "imu_lab"
    assert row.split()[1].endswith("/imu_lab.yaml")
    assert row.split()[-2:] == ["2", "running"]


@pytest.mark.usefixtures("lab")
def test_json_is_one_object_a_run(capsys: Captured):
    assert main(["ps", "--json"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    answer = json.loads(line)
    (process,) = answer["processes"]
    assert (answer["version"], answer["run"], answer["nodes"], answer["state"]) == (1, "imu_lab", 2, "running")
    assert Path(answer["file"]).is_absolute()
    assert answer["since"].endswith("+00:00")
    assert process == {"name": "main", "pid": answer["pid"], "nodes": 2, "restarts": 0, "shared_memory": 0}


@pytest.mark.usefixtures("place")
def test_no_runs_are_no_error(capsys: Captured):
    assert main(["ps"]) == 0
    assert capsys.readouterr() == ("", "nothing is running; start a graph in another terminal: busflow run FILE\n")
    assert main(["ps", "--json"]) == 0
    assert capsys.readouterr() == ("", "")


@pytest.mark.e2e
def test_blocked_run_does_not_answer(project: Path, start_run: Callable[..., Any], capsys: Captured):
    (project / "plugins/blocker.py").write_text(BLOCKER)
    text = (project / "talk.yaml").read_text() + "  blocker:\n    plugin: blocker\n"
    (project / "talk.yaml").write_text(text)
    start_run(project, "talk.yaml").wait_for("blocks")
    assert main(["ps"]) == 0
    captured = capsys.readouterr()
    assert captured.out.splitlines()[1].endswith("?      does not answer")
    assert "talk does not answer: it has just ended, or a handler blocks its event loop" in captured.err


@pytest.mark.e2e
def test_stopped_run_does_not_answer(project: Path, start_run: Callable[..., Any], capsys: Captured):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    run.process.send_signal(signal.SIGSTOP)
    assert main(["ps", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["state"], answer["nodes"], answer["processes"]) == ("does not answer", None, [])
    assert main(["ps"]) == 0
    assert "its process is stopped or hangs" in capsys.readouterr().err


@pytest.mark.e2e
def test_killed_run_leaves_nothing(project: Path, start_run: Callable[..., Any], place: Any, capsys: Captured):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    os.kill(run.process.pid, signal.SIGKILL)
    run.process.wait()
    assert main(["ps"]) == 0
    assert "nothing is running" in capsys.readouterr().err
    assert not (place.path / "talk").exists()


@pytest.mark.usefixtures("lab")
def test_command_of_another_version_warns(capsys: Captured, monkeypatch: pytest.MonkeyPatch):
    """The run is in a process of its own, of the version that is there."""
    theirs = busflow.__version__
    assert main(["topic", "list"]) == 0
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(busflow, "__version__", "7.1.0")
    assert main(["topic", "list"]) == 0
    warning = f"warning: imu_lab runs busflow {theirs}, and this is 7.1.0; what is shown may be wrong\n"
    assert capsys.readouterr().err == warning
