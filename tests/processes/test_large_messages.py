"""Images between the processes of a run, through memory that they share, while readers come, stop and are killed."""

import json
import os
import platform
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(
    not hasattr(os, "memfd_create") or platform.machine() != "x86_64", reason="memory is shared on Linux, x86-64, only"
)

PATIENCE_S = 60.0

PICTURES = """
import numpy as np

from busflow import Node, Parameters, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Image

SIZE = 500_000


class Camera(Node):
    images = publisher(Image, "images")
    taken = 0

    @timer(0.02)
    def take(self) -> None:
        self.taken += 1
        self.images.publish(Image(height=self.taken, data=np.full(SIZE, self.taken % 256, np.uint8)))


class ViewerParameters(Parameters):
    every: int = 25


class Viewer(Node):
    parameters: ViewerParameters
    seen = 0
    last = 0

    @subscription("images")
    def see(self, image: Image) -> None:
        if len(image.data) != SIZE or set(image.data[::1000].tolist()) != {image.height % 256}:
            raise ValueError(f"image {image.height} is torn")
        self.seen += 1
        if self.seen % self.parameters.every == 0:
            in_order = image.height > self.last or image.height == 1  # the first of a camera that was started again
            self.log.info("seen", count=self.seen, last=image.height, in_order=in_order)
        self.last = image.height
"""

RUN = """
processes: {eyes: {restart: on-failure}, other: }
nodes:
  camera: {plugin: "pictures:Camera", process: eyes}
  here: {plugin: "pictures:Viewer"}
  beside: {plugin: "pictures:Viewer", process: other}
"""


def seen(run, *nodes, times=2):
    """Wait until each of these viewers has logged so often again that it has seen images."""
    run.wait_for_more("seen", *nodes, times=times)


def command(run, *words):
    done = subprocess.run(
        [sys.executable, "-m", "busflow", *words],
        env={**os.environ, "BUSFLOW_RUNTIME_DIR": str(run.runtime)},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def shared(run):
    """Bytes that each process shares."""
    (line,) = command(run, "ps", "--json").splitlines()
    return {each["name"]: each["shared_memory"] for each in json.loads(line)["processes"]}


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
    run = start(RUN, "-v", files={"plugins/pictures.py": PICTURES})
    seen(run, "here", "beside")
    assert shared(run) == {"main": 0, "eyes": pytest.approx(16 * 500_000, rel=0.01), "other": 0}
    assert "8 MiB" in command(run, "ps")
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
    command(run, "ps")
    assert not [path for path in run.runtime.iterdir() if path.is_dir()]
    assert not [line for line in run.lines if "torn" in line or '"in_order": false' in line]


@pytest.mark.long
def test_stopped_reader_delays_no_other_reader(start):
    run = start(RUN.replace("other: ", "other: {restart: never}"), "-v", files={"plugins/pictures.py": PICTURES})
    seen(run, "here", "beside")
    before = shared(run)
    run.kill("other", signal.SIGSTOP)
    try:
        seen(run, "here", times=6)
        (line,) = command(run, "ps", "--json").splitlines()
        assert {each["name"]: each.get("shared_memory") for each in json.loads(line)["processes"]}["eyes"] == before[
            "eyes"
        ]
    finally:
        run.kill("other", signal.SIGCONT)
    seen(run, "beside")
    assert run.end() == 130
    images = run.topic("/images")
    assert not [line for line in run.lines if "torn" in line or '"in_order": false' in line]
    here, beside = sorted(images["subscriptions"], key=lambda line: line["node"] != "/here")
    assert here["delivered"] > beside["delivered"], "what a stopped reader missed the other one got"
    assert all(balances(images))


@pytest.mark.long
def test_client_receives_whole_images_beside_the_readers(start):
    run = start(RUN, files={"plugins/pictures.py": PICTURES})
    seen(run, "here", "beside")
    for _ in range(3):
        assert int(command(run, "topic", "echo", "images", "--once", "--field", "height").split()[0]) > 0
    seen(run, "here", "beside")
    assert run.end() == 130
    images = run.topic("/images")
    assert set(images["losses"]) <= {"lost"}, "whole ones may be lost on a busy machine"
    assert not [line for line in run.lines if "torn" in line or '"in_order": false' in line]
    assert all(balances(images))
