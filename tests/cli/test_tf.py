"""`busflow tf` (`tree.py`, `echo.py`, `monitor.py`, `source.py`): frames of runs and recordings; what `doctor` says."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from busflow.testing import harness, virtual_time
from tests.cli.conftest import LABS, Shell
from tests.golden import Golden

PLUGINS = LABS / "plugins"
FOREIGN = ("frames:\n", "  foreign: {plugin: foreign}\nframes:\n")
TWO = ("frames:\n", "  arm: {plugin: arm}\nframes:\n")
"""The second node sends for the first time when the channel of `/tf` is in the file already."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("frames")
    (folder / "plugins").mkdir()
    for name in ("odometry", "foreign"):
        shutil.copy(PLUGINS / f"{name}.py", folder / "plugins")
    arm = (PLUGINS / "odometry.py").read_text("utf-8").replace("class Odometry", "class Arm")
    (folder / "plugins/arm.py").write_text(arm.replace("hz=50", "hz=10").replace("base_link", "arm"), "utf-8")
    (folder / "plugins/quiet.py").write_text("from busflow import Node\n\n\nclass Quiet(Node):\n    pass\n")
    lab = (LABS / "frames.yaml").read_text("utf-8")
    for name, text in (("lab", lab), ("wrong", lab.replace(*FOREIGN)), ("two", lab.replace(*TWO))):
        (folder / f"{name}.yaml").write_text(text)
    (folder / "quiet.yaml").write_text("plugins: [plugins]\nnodes: {quiet: {plugin: quiet}}\n")
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


@pytest.mark.parametrize(
    ("line", "bag", "code"),
    [
        ("tree", "lab", 0),
        ("tree --format dot", "lab", 0),
        ("tree --format mermaid", "lab", 0),
        ("tree --run x", "lab", 2),
        ("echo odom camera --once", "lab", 0),
        ("echo base_link camera", "lab", 0),
        ("echo odom camra", "lab", 1),
        ("monitor", "lab", 0),
        ("tree", "wrong", 3),
        ("tree", "two", 0),
        ("monitor", "two", 0),
        ("tree", "quiet", 2),
    ],
)
def test_output(folder: Path, shell: Shell, monkeypatch: pytest.MonkeyPatch, line: str, bag: str, code: int):
    recorded(folder, bag)
    monkeypatch.chdir(folder)
    assert (
        shell(f"tf {line} --bag {bag}.mcap", mask={r"at: .*Z?": "at: TIME"} if "odom camera" in line else None) == code
    )


def test_json_has_the_same(folder: Path, shell: Shell):
    bag = recorded(folder, "lab")
    answer = shell.data(f"tf tree --bag {bag}")
    assert (answer["roots"], answer["problems"], answer["frames"][1]) == (
        ["odom"],
        [],
        {
            "frame": "camera", "parent": "base_link", "fixed": True, "rate_hz": None, "newest_ns": None,
            "publishers": ["/static_frames"], "one_of": False,
        },
    )  # fmt: skip
    lines = [
        json.loads(line) for line in shell.text(f"tf echo odom camera --bag {bag} --json --period 500ms").splitlines()
    ]
    stamps = [line["stamp_ns"] for line in lines]
    assert [later - before for before, later in pairwise(stamps)] == [500_000_000] * 5
    assert lines[0]["xyz"] == pytest.approx([2, 0.5, 0])
    assert shell.data(f"tf monitor --bag {bag}")["frames"][0]["rate_hz"] == pytest.approx(50)
    problems = shell.data(f"tf monitor --bag {recorded(folder, 'wrong')}", code=3)["problems"]
    assert [each["code"] for each in problems] == ["invalid-transform", "two-parents"]
    first = shell.data(f"tf monitor --bag {recorded(folder, 'two')}")["frames"][0]
    assert (first["publishers"], first["one_of"]) == (["/odometry", "/arm"], True)


@pytest.mark.e2e
def test_verbs_and_doctor_look_at_a_run(
    stand: Callable[..., Any], folder: Path, monkeypatch: pytest.MonkeyPatch, shell: Shell, golden: Golden
):
    place, _ = stand(folder / "wrong.yaml")
    place.look(monkeypatch)
    shell.text("topic echo /tf --once --wait 60s")
    assert "translation: " in shell.text("tf echo odom camera --once --timeout 30s")
    assert "└── camera  (fixed, /static_frames)" in shell.text("tf tree --for 500ms", code=3)
    assert shell("tf echo odom nowhere --timeout 2s") == 1
    findings = {each["code"]: each["message"] for each in shell.data("doctor", code=3)["findings"]}
    found = [f"{code}: {findings[code]}" for code in ("invalid-transform", "two-parents", "two-publishers")]
    golden("\n".join(found), "doctor", mask={r"(publish odom → base_link: ).*": r"\1…"})
    assert "nobody-publishes" not in findings, "a frame needs no publisher of its own"
