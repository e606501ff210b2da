"""`busflow tf` (`tree.py`, `echo.py`, `monitor.py`, `source.py`): frames of runs and recordings; what `doctor` says."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main
from busflow.testing import harness, virtual_time

LAB = """\
name: frames_lab
plugins: [plugins]
nodes:
  odometry: {plugin: odometry}
frames:
  base_link: {camera: {xyz: [0.5, 0, 0]}}
"""
ODOMETRY = '''
from busflow import Node, timer, transforms
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from busflow.msgs.std_msgs import Header


class Odometry(Node):
    """Sends odom → base_link at 50 Hz, 2 m ahead and turned to the left."""

    frames = transforms()

    @timer(hz=50)
    def tick(self) -> None:
        there = Transform(translation=Vector3(x=2.0), rotation=Quaternion(z=0.5**0.5, w=0.5**0.5))
        header = Header(stamp=self.clock.now().to_msg(), frame_id="odom")
        self.frames.send(TransformStamped(header=header, child_frame_id="base_link", transform=there))
'''
FOREIGN = '''
from busflow import Node, publisher, timer
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped
from busflow.msgs.std_msgs import Header
from busflow.msgs.tf2_msgs import TFMessage


class Foreign(Node):
    """Knows nothing of frames, and publishes what is wrong in every way."""

    tf = publisher(TFMessage, "/tf")

    @timer(hz=50)
    def tick(self) -> None:
        stamp = self.clock.now().to_msg()
        edges = ("odom", "base_link", 1.0), ("map", "wheel", 1.0), ("odom", "wheel", 1.0), ("odom", "arm", 0.0)
        for parent, child, w in edges:
            edge = TransformStamped(
                header=Header(stamp=stamp, frame_id=parent),
                child_frame_id=child,
                transform=Transform(rotation=Quaternion(w=w)),
            )
            self.tf.publish(TFMessage(transforms=(edge,)))
'''
Captured = pytest.CaptureFixture[str]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("frames")
    (folder / "plugins").mkdir()
    (folder / "plugins/odometry.py").write_text(ODOMETRY)
    (folder / "plugins/foreign.py").write_text(FOREIGN)
    (folder / "lab.yaml").write_text(LAB)
    (folder / "wrong.yaml").write_text(LAB.replace("frames:\n", "  foreign: {plugin: foreign}\nframes:\n"))
    return folder


def recorded(folder: Path, name: str) -> str:
    file = folder / f"{name}.mcap"

    @virtual_time
    async def record() -> None:
        async with harness(folder / f"{name}.yaml", record=file) as lab:
            await lab.advance(3)

    if not file.exists():
        record()
    return str(file)


def test_tree_of_a_recording_in_each_form(folder: Path, capsys: Captured):
    bag = recorded(folder, "lab")
    assert main(["tf", "tree", "--bag", bag]) == 0
    assert capsys.readouterr().out == (
        "odom\n└── base_link  (50 Hz, /odometry)\n    └── camera  (fixed, /static_frames)\n"
    )
    assert main(["tf", "tree", "--bag", bag, "--format", "dot"]) == 0
    assert capsys.readouterr().out == (
        'digraph frames {\n    "odom" -> "base_link" [label="50 Hz, /odometry"];\n'
        '    "base_link" -> "camera" [label="fixed, /static_frames"];\n}\n'
    )
    assert main(["tf", "tree", "--bag", bag, "--format", "mermaid"]) == 0
    assert capsys.readouterr().out.splitlines()[0:5:4] == [
        "flowchart TD", '    f2 -->|"50 Hz, /odometry"| f0'
    ]  # fmt: skip
    assert main(["tf", "tree", "--bag", bag, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["roots"], answer["problems"], answer["frames"][1]) == (
        ["odom"],
        [],
        {
            "frame": "camera", "parent": "base_link", "fixed": True, "rate_hz": None, "newest_ns": None,
            "publishers": ["/static_frames"], "one_of": False,
        },
    )  # fmt: skip


def test_echo_prints_where_a_frame_is(folder: Path, capsys: Captured):
    bag = recorded(folder, "lab")
    assert main(["tf", "echo", "odom", "camera", "--bag", bag, "--once"]) == 0
    assert capsys.readouterr().out.splitlines()[1:] == [
        "translation: [2.0, 0.5, 0.0]",
        "quaternion: [0.0, 0.0, 0.707107, 0.707107]",
        "rpy: [0.0, 0.0, 1.570796]",
        "rpy_degrees: [0.0, 0.0, 90.0]",
        "---",
    ]
    assert main(["tf", "echo", "odom", "camera", "--bag", bag, "--json", "--period", "500ms"]) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    stamps = [line["stamp_ns"] for line in lines]
    assert [later - before for before, later in pairwise(stamps)] == [500_000_000] * 5
    assert lines[0]["xyz"] == pytest.approx([2, 0.5, 0])
    assert main(["tf", "echo", "base_link", "camera", "--bag", bag]) == 0
    assert capsys.readouterr().out.count("at: any time") == 1


def test_echo_without_a_transform_says_why(folder: Path, capsys: Captured):
    assert main(["tf", "echo", "odom", "camra", "--bag", recorded(folder, "lab")]) == 1
    assert capsys.readouterr().err == "error: there is no frame 'camra'; did you mean 'camera'?\n"


def test_monitor_measures_rate_delay_and_publisher(folder: Path, capsys: Captured):
    assert main(["tf", "monitor", "--bag", recorded(folder, "lab")]) == 0
    assert [line.split() for line in capsys.readouterr().out.splitlines()] == [
        ["frame", "parent", "transforms", "rate", "delay", "longest", "published", "by"],
        ["base_link", "odom", "150", "50.0", "Hz", "0.0", "ms", "0.0", "ms", "/odometry"],
        ["camera", "base_link", "1", "fixed", "/static_frames"],
    ]
    assert main(["tf", "monitor", "--bag", recorded(folder, "lab"), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["frames"][0]["rate_hz"] == pytest.approx(50)


NO_ROTATION = ": no rotation is (0, 0, 0, 1)"
WRONG = [
    "/foreign publishes an invalid transform: odom → arm: its quaternion (0, 0, 0, 0) has the length 0, not 1",
    "the frame wheel has had the parents map and odom, by /foreign",
    "2 nodes publish odom → base_link: ",
]


def test_what_is_wrong_in_a_recording_is_named(folder: Path, capsys: Captured):
    assert main(["tf", "monitor", "--bag", recorded(folder, "wrong"), "--json"]) == 3
    first, second = (each["message"] for each in json.loads(capsys.readouterr().out)["problems"])
    assert "/foreign" in first
    assert first.endswith("publishes an invalid transform: " + WRONG[0].partition(" transform: ")[2] + NO_ROTATION)
    assert second.startswith(WRONG[1].removesuffix("/foreign"))
    assert main(["tf", "tree", "--bag", recorded(folder, "wrong")]) == 3
    assert "error: the frame wheel has had the parents" in capsys.readouterr().out


ARM = ODOMETRY.replace("class Odometry", "class Arm").replace("hz=50", "hz=10").replace("base_link", "arm")


def test_recording_names_each_publisher_that_may_be(folder: Path, capsys: Captured):
    """The second node sends for the first time when the channel of `/tf` is in the file already."""
    (folder / "plugins/arm.py").write_text(ARM)
    (folder / "two.yaml").write_text(LAB.replace("frames:\n", "  arm: {plugin: arm}\nframes:\n"))
    bag = recorded(folder, "two")
    assert main(["tf", "tree", "--bag", bag]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "odom",
        "├── arm  (10 Hz, one of /odometry, /arm)",
        "└── base_link  (50 Hz, one of /odometry, /arm)",
        "    └── camera  (fixed, /static_frames)",
    ]
    assert main(["tf", "monitor", "--bag", bag]) == 0
    assert "  one of /odometry, /arm\n" in capsys.readouterr().out
    assert main(["tf", "monitor", "--bag", bag, "--json"]) == 0
    first = json.loads(capsys.readouterr().out)["frames"][0]
    assert (first["publishers"], first["one_of"]) == (["/odometry", "/arm"], True)


def test_recording_without_frames_is_an_error(folder: Path, capsys: Captured):
    (folder / "plugins/quiet.py").write_text("from busflow import Node\n\n\nclass Quiet(Node):\n    pass\n")
    (folder / "quiet.yaml").write_text("plugins: [plugins]\nnodes: {quiet: {plugin: quiet}}\n")
    assert main(["tf", "tree", "--bag", recorded(folder, "quiet")]) == 2
    assert "the recording has no /tf and no /tf_static" in capsys.readouterr().err
    assert main(["tf", "tree", "--bag", recorded(folder, "lab"), "--run", "x"]) == 2
    assert "--run is for graphs that run" in capsys.readouterr().err


@pytest.mark.e2e
def test_verbs_and_doctor_look_at_a_run(stand: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, capsys: Captured):
    lab = LAB.replace("frames:\n", "  foreign: {plugin: foreign}\nframes:\n")
    place, _ = stand("frames_lab", lab, {"odometry": ODOMETRY, "foreign": FOREIGN})
    place.look(monkeypatch)
    assert main(["topic", "echo", "/tf", "--once", "--wait", "60s"]) == 0
    assert main(["tf", "echo", "odom", "camera", "--once", "--timeout", "30s"]) == 0
    assert "translation: " in capsys.readouterr().out
    assert main(["tf", "tree", "--for", "500ms"]) == 3
    out = capsys.readouterr().out
    assert "└── camera  (fixed, /static_frames)" in out
    assert main(["doctor", "--json"]) == 3
    texts = [each["message"] for each in json.loads(capsys.readouterr().out)["findings"]]
    for start in WRONG:
        assert any(text.startswith(start) for text in texts), texts
    assert not any("no publisher" in text for text in texts)
    assert main(["tf", "echo", "odom", "nowhere", "--timeout", "2s"]) == 1
    assert "there is no frame 'nowhere'" in capsys.readouterr().err
