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
from tests.cli.conftest import Shell, append
from tests.golden import Golden

pytestmark = pytest.mark.usefixtures("project")
BUSFLOW = [sys.executable, "-m", "busflow"]
SIM = ["--sim", "--for", "1s"]


def topics(path):
    with Bag(path) as bag:
        assert bag.complete
        return {channel.topic for channel in bag.channels if channel.count and not channel.topic.startswith("/_")}


def test_a_run_is_recorded(shell: Shell):
    assert shell("run talk.yaml --sim --for 30ms --record run.mcap") == 0
    assert topics("run.mcap") == {"/numbers", "/parameter_events", "/rosout"}


def test_only_the_topics_that_are_asked_for():
    assert main(["run", "talk.yaml", *SIM, "--record", "run.mcap", "--record-topics", "num*"]) == 0
    assert topics("run.mcap") == {"/numbers", "/parameter_events"}


def test_launch_file_states_destination_and_topics():
    append("record: {to: 'runs/{name}.mcap', exclude: [/rosout], compression: lz4}\n")
    Path("runs").mkdir()
    assert main(["run", "talk.yaml", *SIM]) == 0
    assert topics("runs/talk.mcap") == {"/numbers", "/parameter_events"}


def test_command_line_overrides_the_file_only():
    append("record: {to: a.mcap, exclude: [/rosout]}\n")
    assert main(["run", "talk.yaml", *SIM, "--record", "b.mcap"]) == 0
    assert topics("b.mcap") == {"/numbers", "/parameter_events"}
    assert not Path("a.mcap").exists()


def test_impossible_recording_is_refused_before_the_run(shell: Shell):
    Path("run.mcap").write_bytes(b"precious")
    assert shell("run talk.yaml --sim --for 1s --record run.mcap") == 2
    assert Path("run.mcap").read_bytes() == b"precious"
    assert shell("run talk.yaml --sim --for 1s --record runs/run.mcap") == 2
    assert shell("run talk.yaml --sim --for 1s --record-topics num*") == 2


def test_too_few_files_are_one_error(shell: Shell, monkeypatch: pytest.MonkeyPatch):
    def refuse(*_: object):
        raise OSError(errno.EMFILE, "Too many open files")

    monkeypatch.setattr("socket.socketpair", refuse)
    assert shell("run talk.yaml") == 1


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
def test_full_disk_is_reported_once_without_stopping(how: list[str], golden: Golden):
    done = run_with_little_room(*how, "--report", "run.json", "--set", "nodes.listener.plugin=talker")
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("is incomplete") == 1
    (line,) = [line for line in done.stderr.splitlines() if "is incomplete" in line]
    golden(line.partition("run.mcap")[2])
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
    assert done.stderr.splitlines()[-1].startswith("error: the recording run.mcap ")
    assert "INCOMPLETE" in done.stdout
    assert "Traceback" not in done.stderr


@pytest.mark.e2e
@pytest.mark.parametrize("merged", [False, True], ids=["output", "output and errors"])
def test_closed_reader_leaves_the_runs_exit_code(merged: bool):
    read, write = os.pipe()
    os.close(read)
    command = [*BUSFLOW, "run", "talk.yaml", "--set", "nodes.talker.parameters.fail_at=1"]
    with os.fdopen(write, "wb") as closed:
        errors = closed if merged else subprocess.DEVNULL
        assert subprocess.run(command, stdout=closed, stderr=errors, timeout=60).returncode == 1
