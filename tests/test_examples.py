"""The examples: each is complete, on the page, without a problem, and does what its launch file expects."""

from pathlib import Path

import pytest

from busflow.cli import main

FOLDER = Path(__file__).parents[1] / "examples"
EXAMPLES = sorted(path for path in FOLDER.iterdir() if path.is_dir() and not path.name.startswith(("_", ".")))
FILES = sorted(FOLDER.glob("*/*.yaml"))
each_file = pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)


def test_every_example_is_complete_and_on_the_page():
    page = (FOLDER / "README.md").read_text("utf-8")
    assert len(EXAMPLES) >= 6
    for folder in EXAMPLES:
        assert (len([*folder.glob("*.yaml")]), len([*folder.glob("test_*.py")])) == (1, 1), folder
        assert f"[{folder.name}]({folder.name})" in page


@each_file
def test_check_finds_nothing_even_when_strict(file: Path, capsys: pytest.CaptureFixture[str]):
    assert main(["check", str(file), "--strict"]) == 0
    assert capsys.readouterr().out == "no problems\n"


@pytest.mark.parametrize("name", ["talker_listener/talker.yaml", "service_robot/robot.yaml"])
def test_what_it_expects_holds(name: str, capsys: pytest.CaptureFixture[str]):
    assert main(["test", str(FOLDER / name), "--for", "10s"]) == 0, capsys.readouterr().err
