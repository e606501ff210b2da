"""`busflow ps`: lists runs, and those that do not answer."""

import os
import re
import shutil
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import busflow
from tests.cli.conftest import LABS, Shell, append

CHANGING = {
    r"[^ \n]+(/|…)(\w+\.yaml)": r"\2",
    r"(\.yaml +)\d+": r"\1PID",
    r"process \d+": "process PID",
    r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d +(\d+(d|h|min|s) )+ *": "TIME  AGE  ",
    " {2,}": "  ",
}


@pytest.mark.usefixtures("lab")
def test_run_has_file_process_age_and_state(shell: Shell):
    assert shell("ps", mask=CHANGING) == 0
    answer = shell.data("ps")
    (process,) = answer["processes"]
    assert (answer["version"], answer["run"], answer["nodes"], answer["state"]) == (1, "imu_lab", 2, "running")
    assert Path(answer["file"]).is_absolute()
    assert answer["since"].endswith("+00:00")
    assert process == {"name": "main", "pid": answer["pid"], "nodes": 2, "restarts": 0, "shared_memory": 0}


@pytest.mark.usefixtures("place")
def test_no_runs_are_no_error(shell: Shell):
    assert shell("ps") == 0
    assert shell("ps --json") == 0


@pytest.mark.e2e
def test_blocked_run_does_not_answer(project: Path, start_run: Callable[..., Any], shell: Shell):
    shutil.copy(LABS / "plugins/blocker.py", "plugins")
    append("  blocker:\n    plugin: blocker\n")
    start_run(project, "talk.yaml").wait_for("blocks")
    assert shell("ps", mask=CHANGING) == 0


@pytest.mark.e2e
def test_stopped_run_does_not_answer(project: Path, start_run: Callable[..., Any], shell: Shell):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    run.process.send_signal(signal.SIGSTOP)
    answer = shell.data("ps")
    assert (answer["state"], answer["nodes"], answer["processes"]) == ("does not answer", None, [])
    assert shell("ps", mask=CHANGING) == 0


@pytest.mark.e2e
def test_killed_run_leaves_nothing(project: Path, start_run: Callable[..., Any], place: Any, shell: Shell):
    run = start_run(project, "talk.yaml")
    run.wait_for("heard")
    os.kill(run.process.pid, signal.SIGKILL)
    run.process.wait()
    assert shell("ps") == 0
    assert not (place.path / "talk").exists()


@pytest.mark.usefixtures("lab")
def test_command_of_another_version_warns(shell: Shell, monkeypatch: pytest.MonkeyPatch):
    """The run is in a process of its own, of the version that is there."""
    theirs = busflow.__version__
    assert shell("node list") == 0
    monkeypatch.setattr(busflow, "__version__", "7.1.0")
    assert shell("node list", mask={re.escape(theirs): "VERSION"}) == 0
