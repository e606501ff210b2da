"""`running.py`: the recording of a run, by `busflow run --record` or `record:`, also on failures and full disks."""

import errno
import json
import os
import resource
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from busflow.cli import main
from busflow.recording.bag.bag import Bag

pytestmark = pytest.mark.usefixtures("project")
Captured = pytest.CaptureFixture[str]
BUSFLOW = [sys.executable, "-m", "busflow"]
SIM = ["--sim", "--for", "1s"]
BAD = """
from busflow import Node


class Bad(Node):
    async def start(self) -> None:
        raise ValueError("no device")
"""


def topics(path):
    with Bag(path) as bag:
        assert bag.complete
        return {channel.topic for channel in bag.channels if channel.count and not channel.topic.startswith("/_")}


def with_record(text):
    Path("talk.yaml").write_text(Path("talk.yaml").read_text() + text)


def test_a_run_is_recorded(capsys: Captured):
    assert main(["run", "talk.yaml", *SIM, "--record", "run.mcap"]) == 0
    assert capsys.readouterr().out.rstrip().splitlines()[-1].endswith("messages recorded, complete")
    assert topics("run.mcap") == {"/numbers", "/parameter_events", "/rosout"}


def test_only_the_topics_that_are_asked_for():
    assert main(["run", "talk.yaml", *SIM, "--record", "run.mcap", "--record-topics", "num*"]) == 0
    assert topics("run.mcap") == {"/numbers", "/parameter_events"}


def test_patterns_without_a_file_are_refused(capsys: Captured):
    assert main(["run", "talk.yaml", *SIM, "--record-topics", "num*"]) == 2
    assert "add --record FILE" in capsys.readouterr().err


def test_launch_file_states_destination_and_topics():
    with_record("record: {to: 'runs/{name}.mcap', exclude: [/rosout], compression: lz4}\n")
    Path("runs").mkdir()
    assert main(["run", "talk.yaml", *SIM]) == 0
    assert topics("runs/talk.mcap") == {"/numbers", "/parameter_events"}


def test_command_line_overrides_the_file_only():
    with_record("record: {to: a.mcap, exclude: [/rosout]}\n")
    assert main(["run", "talk.yaml", *SIM, "--record", "b.mcap"]) == 0
    assert topics("b.mcap") == {"/numbers", "/parameter_events"}
    assert not Path("a.mcap").exists()


def test_existing_recording_is_refused_before_the_run(capsys: Captured):
    Path("run.mcap").write_bytes(b"precious")
    assert main(["run", "talk.yaml", *SIM, "--record", "run.mcap"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert "error: run.mcap is there already" in err
    assert Path("run.mcap").read_bytes() == b"precious"


def test_missing_folder_is_reported_with_the_fix(capsys: Captured):
    assert main(["run", "talk.yaml", *SIM, "--record", "runs/run.mcap"]) == 2
    assert "mkdir -p runs" in capsys.readouterr().err


def test_too_few_files_are_one_error(capsys: Captured, monkeypatch: pytest.MonkeyPatch):
    def refuse(*_: object):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr("socket.socketpair", refuse)
    assert main(["run", "talk.yaml"]) == 1
    assert capsys.readouterr().err == "error: Too many open files: allow more, for instance with ulimit -n 1024\n"


def test_a_graph_that_cannot_run_leaves_no_file():
    assert main(["run", "talk.yaml", *SIM, "--record", "run.mcap", "--set", "nodes.talker.plugin=nothing"]) == 2
    assert not Path("run.mcap").exists()


def test_failing_node_leaves_a_complete_recording():
    failing = ["--set", "nodes.talker.parameters.fail_at=50"]
    assert main(["run", "talk.yaml", *SIM, "--record", "run.mcap", *failing]) == 1
    with Bag("run.mcap") as bag:
        assert bag.complete
        assert bag.ledger.report["exit_code"] == 1


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_the_file_too(number: signal.Signals, code: int):
    with subprocess.Popen([*BUSFLOW, "run", "talk.yaml", "--record", "run.mcap"], stderr=subprocess.PIPE) as it:
        assert it.stderr is not None
        while b"heard" not in it.stderr.readline():
            pass
        it.send_signal(number)
        it.stderr.read()
    assert it.returncode == code
    assert topics("run.mcap") >= {"/numbers"}


def run_with_little_room(*options: str) -> subprocess.CompletedProcess[str]:
    """Run with a limit on file sizes, which acts as a full disk."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, 30_000))

    command = [*BUSFLOW, "run", "talk.yaml", "--record", "run.mcap", "--set", "record.to=run.mcap", *options]
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    return subprocess.run(command, preexec_fn=limit, capture_output=True, text=True, env=environment)


@pytest.mark.long
@pytest.mark.parametrize("how", [["--sim", "--for", "5s", "rate_hz:=1000"], ["--for", "4s", "rate_hz:=1000"]])
def test_full_disk_is_reported_once_without_stopping(how: list[str]):
    done = run_with_little_room(*how, "--report", "run.json", "--set", "nodes.listener.plugin=talker")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("is incomplete") == 1
    assert "run.mcap is incomplete: nothing more can be written to it: File too large" in done.stderr
    assert "INCOMPLETE" in done.stdout
    answer = json.loads(Path("run.json").read_text())
    assert answer["recording"]["missed"] > 0
    with Bag("run.mcap") as bag:
        found = [entry.sequence for entry in bag.entries()]
        assert not bag.complete
    assert found == list(range(1, len(found) + 1))
    assert 0 < len(found) < answer["topics"][0]["published"]


@pytest.mark.long
@pytest.mark.parametrize("how", [["--sim", "--for", "5s"], ["--for", "20s"]])
def test_full_disk_ends_run_with_on_drop_fail(how: list[str]):
    done = run_with_little_room(*how, "rate_hz:=1000", "--set", "record.on_drop=fail")
    assert done.returncode == 5
    assert "error: the recording run.mcap is incomplete: nothing more can be written to it" in done.stderr
    assert "INCOMPLETE" in done.stdout
    assert "Traceback" not in done.stderr


@pytest.mark.e2e
@pytest.mark.parametrize("merged", [False, True], ids=["output", "output and errors"])
def test_closed_reader_leaves_the_runs_exit_code(tmp_path: Path, merged: bool):
    (tmp_path / "bad.py").write_text(BAD)
    (tmp_path / "bad.yaml").write_text("plugins: [.]\nnodes: {bad: {plugin: bad}}\n")
    read, write = os.pipe()
    os.close(read)
    command = [*BUSFLOW, "run", "bad.yaml", "--for", "1s"]
    with os.fdopen(write, "wb") as closed:
        errors = closed if merged else subprocess.DEVNULL
        assert subprocess.run(command, cwd=tmp_path, stdout=closed, stderr=errors, timeout=60).returncode == 1
