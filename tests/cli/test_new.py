"""`busflow new`: makes a project that is right as it stands, or nothing."""

import os
import resource
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from busflow.cli import main
from tests.cli.conftest import Shell
from tests.extras import FAILS_IN_ASCII


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_project_passes_check_run_and_tests(shell: Shell, monkeypatch: pytest.MonkeyPatch):
    assert shell("new rover") == 0
    monkeypatch.chdir("rover")
    assert main(["check", "--strict", "configs/rover.yaml"]) == 0
    assert "/cmd_vel" in shell.text("run configs/rover.yaml speed:=0.1 --for 150ms")
    options = ["-q", "-W", "error", "-p", "no:asyncio", "-p", "no:anyio", "-p", "no:cacheprovider"]
    done = subprocess.run([sys.executable, "-P", "-m", "pytest", *options], capture_output=True, text=True)
    assert "2 passed" in done.stdout, done.stdout
    assert "async with harness(" in Path("tests/test_driver.py").read_text(), "its test is on virtual time"


@pytest.mark.long
def test_project_tests_can_import_plugins(monkeypatch: pytest.MonkeyPatch):
    """Also beside an editable busflow, whose clone has a folder of that name on the path."""
    assert main(["new", "rover"]) == 0
    monkeypatch.chdir("rover")
    Path("tests/test_more.py").write_text(
        "from plugins.driver import Driver\n\n\ndef test_it():\n    assert Driver.__name__ == 'Driver'\n"
    )
    command = ["-P", "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/test_more.py"]  # -P: as plain `pytest` does
    done = subprocess.run([sys.executable, *command], capture_output=True, text=True)
    assert "1 passed" in done.stdout, done.stdout


def test_the_project_bears_its_name_everywhere():
    assert main(["new", "deep/down/rover2"]) == 0
    project = Path("deep/down/rover2")
    files = sorted(str(path.relative_to(project)) for path in project.rglob("*") if path.is_file())
    assert files == [
        ".gitignore",
        "README.md",
        "configs/rover2.yaml",
        "plugins/driver.py",
        "pyproject.toml",
        "tests/test_driver.py",
    ]
    assert not any("my_robot" in (project / file).read_text() for file in files)
    assert tomllib.loads((project / "pyproject.toml").read_text())["project"]["name"] == "rover2"


def test_the_project_satisfies_linter_and_formatter():
    pytest.importorskip("ruff", reason="running the tests alone needs no linter")
    assert main(["new", "rover"]) == 0
    for check in (
        ["check", "--select", "E,F,I,B,UP", "--line-length", "120"],
        ["format", "--check", "--line-length", "120"],
    ):
        done = subprocess.run([sys.executable, "-m", "ruff", *check, "rover"], capture_output=True, text=True)
        assert done.returncode == 0, done.stdout


NAMES = [
    *("My-Robot", "9lives", "a__b", "class", "busflow", "numpy", "x" * 300, "\x1b[31m", "a/.."),
    *("/proc/rover", ".", ".."),
    pytest.param("größe", marks=FAILS_IN_ASCII),
]


@pytest.mark.parametrize("name", NAMES, ids=lambda name: name[:10])
def test_invalid_name_gets_a_proposal(shell: Shell, here: Path, name: str):
    assert shell("new", name) == 2
    assert list(here.iterdir()) == []


def test_nothing_is_overwritten(shell: Shell):
    Path("folder").mkdir()
    Path("file").write_text("mine")
    for name in ("folder", "file"):
        assert shell(f"new {name}") == 2
    assert (list(Path("folder").iterdir()), Path("file").read_text()) == ([], "mine")


def test_half_a_project_is_not_left_behind(shell: Shell, here: Path):
    def no_space() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

    command = [sys.executable, "-m", "busflow", "new", "rover"]
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}  # or half a module would be left behind
    done = subprocess.run(command, capture_output=True, text=True, preexec_fn=no_space, env=environment)
    assert done.returncode == 2
    shell.note(done.stderr, mask={r"rover\S*:": "rover…:"})
    assert list(here.iterdir()) == []
