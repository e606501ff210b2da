"""Images between the processes of a run, through memory that they share, while readers come, stop and are killed."""

import json
import os
import signal
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "memfd_create"), reason="memory is shared on Linux only")

PATIENCE_S = 60.0

RUN = """
processes: {eyes: {restart: on-failure}, other: }
nodes:
  camera: {plugin: "images:Camera", process: eyes}
  here: {plugin: "images:Viewer"}
  beside: {plugin: "images:Viewer", process: other}
"""


def seen(run, *nodes, times=2):
    """Wait until each of these viewers has logged so often again that it has seen images."""
    run.wait_for_more("seen", *nodes, times=times)


def shared(run):
    """Bytes that each process shares."""
    (line,) = run.busflow("ps", "--json").splitlines()
    return {each["name"]: each.get("shared_memory") for each in json.loads(line)["processes"]}


def mapped(pid):
    """The arenas that a process has mapped."""
    try:
        lines = Path(f"/proc/{pid}/maps").read_text().splitlines()
    except OSError:  # it ends, or belongs to another user
        return set()
    return {line.split()[4] for line in lines if "/memfd:busflow" in line}


def balances(topic):
    lost = topic["losses"].get("lost", 0)
    return [
        line["published"] == line["delivered"] + line["dropped"] + line["queued"] >= topic["published"] - lost > 0
        for line in topic["subscriptions"]
    ]


@pytest.mark.long
def test_memory_is_freed_with_its_processes(start, have_ended):
    run = start(RUN, "-v")
    seen(run, "here", "beside")
    used = shared(run)
    assert 500_000 <= used.pop("eyes") <= 16 * 500_000
    assert used == {"main": 0, "other": 0}
    assert "MiB" in run.busflow("ps")
    pids = [run.process.pid, *run.pids().values()]
    assert [len(mapped(pid)) for pid in pids] == [1, 1, 1]
    (first,) = mapped(run.process.pid)
    run.kill("eyes")
    run.wait_for("the process eyes is started", times=2)
    seen(run, "here", "beside")
    pids = [run.process.pid, *run.pids().values()]
    assert [len(mapped(pid)) for pid in pids] == [1, 1, 1], "that of the killed process is closed"
    assert first not in mapped(run.process.pid)
    arenas = mapped(run.process.pid)
    for pid in pids:
        os.kill(pid, signal.SIGKILL)
    run.end(None)
    assert have_ended(pids, PATIENCE_S)
    processes = [int(path.name) for path in Path("/proc").iterdir() if path.name.isdecimal()]
    assert not [pid for pid in processes if mapped(pid) & arenas]
    run.busflow("ps")
    assert not [path for path in run.runtime.iterdir() if path.is_dir()]
    assert not [line for line in run.lines if "torn" in line or '"in_order": false' in line]


@pytest.mark.long
def test_stopped_reader_delays_no_other_reader(start):
    run = start(RUN.replace("other: ", "other: {restart: never}"), "-v")
    seen(run, "here", "beside")
    for _ in range(3):
        assert int(run.busflow("topic", "echo", "images", "--once", "--field", "height").split()[0]) > 0
    run.kill("other", signal.SIGSTOP)
    try:
        seen(run, "here", times=6)
        assert shared(run)["eyes"] <= 32 * 500_000, "no more than two readers may hold"
    finally:
        run.kill("other", signal.SIGCONT)
    seen(run, "beside")
    assert run.end() == 130
    images = run.topic("/images")
    assert set(images["losses"]) <= {"lost"}, "whole ones may be lost on a busy machine"
    assert not [line for line in run.lines if "torn" in line or '"in_order": false' in line]
    here, beside = sorted(images["subscriptions"], key=lambda line: line["node"] != "/here")
    assert here["delivered"] > beside["delivered"], "a stopped reader misses images that the other one gets"
    assert all(balances(images))
