"""What docs/compatibility.md promises: recordings of released versions, launch files, deprecations."""

import ast
from pathlib import Path

import pytest
from packaging.version import Version

import busflow
from busflow.cli import main
from busflow.recording.bag import Bag
from busflow.testing import replay

PROJECT = Path(__file__).parents[1]
RELEASED = sorted(path for path in (PROJECT / "tests/cases/recordings").iterdir() if path.is_dir())
each_release = pytest.mark.parametrize("folder", RELEASED, ids=lambda folder: folder.name)


def test_this_version_s_line_has_a_recording():
    assert [
        path.name for path in RELEASED if Version(path.name).release[:2] == Version(busflow.__version__).release[:2]
    ]


@each_release
def test_recording_of_a_released_version_is_read(folder: Path, capsys: pytest.CaptureFixture[str]):
    with Bag(folder / "run.mcap") as bag:
        assert (bag.digest(), bag.complete) == ((folder / "digest.txt").read_text().strip(), True)
    assert main(["bag", "verify", str(folder / "run.mcap")]) == 0
    assert main(["bag", "info", "--json", str(folder / "run.mcap")]) == 0
    assert f'"busflow": "{folder.name}"' in capsys.readouterr().out


@each_release
def test_recording_of_a_released_version_replays(folder: Path):
    outcome = replay(folder / "run.mcap", folder / "graph.yaml")
    outcome.assert_same()
    assert outcome.compared["/total"] == 30


def overdue(source: str, version: str) -> list[int]:
    """Lines that announce what this version should not have any more."""
    calls = [each for each in ast.walk(ast.parse(source)) if isinstance(each, ast.Call)]
    announced = {word.value: call.lineno for call in calls for word in call.keywords if word.arg == "gone_in"}
    return [line for gone, line in announced.items() if Version(ast.literal_eval(gone)) <= Version(version)]


@pytest.mark.parametrize(("version", "lines"), [("0.2.9", []), ("0.3.0", [2])])
def test_overdue_deprecation_is_seen(version: str, lines: list[int]):
    assert overdue('\nwarn_of("Node.old", instead="write Node.new", gone_in="0.3")', version) == lines


def test_what_was_announced_is_gone_in_time():
    sources = PROJECT.glob("busflow/**/*.py")
    assert [path.name for path in sources if overdue(path.read_text("utf-8"), busflow.__version__)] == []


def test_launch_file_of_a_later_version_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "lab.yaml"
    file.write_text('busflow: ">=7.1"\nnodes:\n  source: {plugin: source}\n')
    assert main(["check", str(file)]) == 3
    shown = capsys.readouterr().out
    assert "lab.yaml:1:10: error: " in shown
    assert all(f" {version}" in shown for version in (">=7.1", busflow.__version__))
