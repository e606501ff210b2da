"""Windows and macOS, as far as Linux can show: busflow without the names that they lack, and their `sys.platform`."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
NO_SOCKETS = (
    "this platform has no sockets that only one user can open, which connect terminals and processes: "
    "use Linux, or WSL on Windows"
)


@dataclass
class Done:
    """What a command of busflow did."""

    code: int
    out: str
    err: str


def on(platform: str) -> dict[str, str]:
    """The environment of processes that lack what the platform lacks, as do those that they start."""
    folder = PROJECT / "tests/every_process"
    return {**os.environ, "PYTHONPATH": str(folder), "PRETENDED_PLATFORM": platform}


def ran(platform: str, *commands: str) -> dict[str, Done]:
    """What commands do one after the other in an interpreter that lacks what the platform lacks."""
    line = [sys.executable, "-m", "tests.other_platforms", *commands]
    done = subprocess.run(line, cwd=PROJECT, env=on(platform), capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    printed = done.stdout
    return {command: Done(*done) for command, done in json.loads(printed).items()}


LAB, SPREAD = PROJECT / "configs/lab1.yaml", PROJECT / "configs/lab1_processes.yaml"
WORKS = {
    "check": f"check {LAB} --strict",
    "sim": f"run {LAB} --sim --for 2s",
    "record": f"run {LAB} --sim --for 2s --record {{folder}}/lab.mcap",
    "info": "bag info {folder}/lab.mcap",
    "replay": f"replay {{folder}}/lab.mcap {LAB}",
    "test": f"test {LAB} --for 2s",
    "harness": f"run {SPREAD} --one-process --for 0.1s",
    "wall": f"run {LAB} --for 0.1s",
}
NEEDS_SOCKETS = {
    "topic list": "",
    "ps": "",
    "node list": "",
    f"run {SPREAD} --for 0.1s": ", or run all nodes in this process: --one-process",
}


@pytest.fixture(scope="module")
def on_windows(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Done]:
    folder = tmp_path_factory.mktemp("windows")
    works = {name: command.format(folder=folder) for name, command in WORKS.items()}
    done = ran("win32", *works.values(), *NEEDS_SOCKETS, "doctor --json")
    return {**done, **{name: done[command] for name, command in works.items()}}


@pytest.mark.parametrize("name", WORKS)
def test_windows_needs_no_posix_for(name: str, on_windows: dict[str, Done]):
    assert on_windows[name].code == 0, on_windows[name].err
    assert "Traceback" not in on_windows[name].err


def test_lab_loses_nothing_on_virtual_time(on_windows: dict[str, Done]):
    assert "lab1: 2.000 s of sim time, " in on_windows["sim"].out
    assert on_windows["record"].out.rstrip().endswith("complete")


@pytest.mark.parametrize(("command", "otherwise"), NEEDS_SOCKETS.items(), ids=["topic", "ps", "node", "processes"])
def test_what_needs_sockets_says_what_to_do(command: str, otherwise: str, on_windows: dict[str, Done]):
    done = on_windows[command]
    assert (done.code != 0, done.err.splitlines()[-1]) == (True, f"error: {NO_SOCKETS}{otherwise}")
    assert "Traceback" not in done.err


def test_run_on_wall_time_says_what_is_missing(on_windows: dict[str, Done]):
    assert f": {NO_SOCKETS}" in on_windows["wall"].err


def test_doctor_reports_the_platform_once(on_windows: dict[str, Done]):
    findings = json.loads(on_windows["doctor --json"].out)["findings"]
    assert [each["code"] for each in findings] == ["no-unix-sockets"]


def test_macos_runs_a_graph_that_is_looked_into():
    command = f"run {LAB} --for 0.1s"
    done = ran("darwin", command)[command]
    assert (done.code, "cannot be inspected" in done.err) == (0, False), done.err


CAMERA = """
import platform
import sys

import numpy as np
from busflow import Node, QoS, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Header

HERE = Header(frame_id=f"{sys.platform}_{platform.machine()}")

PIXELS = np.zeros(6_000_000, dtype=np.uint8)


class Camera(Node):
    picture = publisher(Image, "picture")

    @timer(0.1)
    def take(self) -> None:
        self.picture.publish(Image(header=HERE, height=1000, width=2000, encoding="rgb8", step=6000, data=PIXELS))


class Viewer(Node):
    @subscription("picture", qos=QoS(depth=1))
    def on_picture(self, image: Image) -> None:
        self.log.info("seen", bytes=len(image.data), sent_from=image.header.frame_id)
"""
TWO_PROCESSES = """
plugins: [.]
processes: {eyes: }
nodes:
  camera: {plugin: "camera:Camera", process: eyes}
  viewer: {plugin: "camera:Viewer"}
"""


def test_macos_sends_images_between_processes(tmp_path: Path):
    (tmp_path / "camera.py").write_text(CAMERA)
    (tmp_path / "images.yaml").write_text(TWO_PROCESSES)
    line = [sys.executable, "-m", "busflow", "run", "images.yaml", "--report", "report.json"]
    with subprocess.Popen(line, cwd=tmp_path, env=on("darwin"), stderr=subprocess.PIPE, text=True) as run:
        log = iter(run.stderr or ())
        images = (each for each in log if "seen bytes=6000000 sent_from=darwin_arm64" in each)
        seen = [each for _, each in zip(range(3), images, strict=False)]
        run.send_signal(signal.SIGINT)
        rest = "".join(log)
    assert (run.returncode, len(seen), "Traceback" in rest) == (130, 3, False), rest
    report = json.loads((tmp_path / "report.json").read_text())
    (topic,) = [each for each in report["topics"] if each["name"] == "/picture"]
    (line,) = topic["subscriptions"]
    assert line["published"] == line["delivered"] + line["dropped"] + line["queued"] >= 3
