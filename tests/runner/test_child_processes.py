"""What a node starts ends with its run, whichever command runs it; what has left for a session of its own is named."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = [
    pytest.mark.e2e,
    pytest.mark.skipif(sys.platform != "linux", reason="only Linux lists the children of a process"),
]

NODE = """
import asyncio, multiprocessing, os, subprocess, sys, time
from concurrent.futures import ProcessPoolExecutor
from busflow import Node

EARLY = subprocess.Popen(["sleep", "600"])


class Parent(Node):
    async def start(self) -> None:
        self.pool = ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("fork"))
        await asyncio.get_running_loop().run_in_executor(self.pool, os.getpid)
        self.child = subprocess.Popen(["sleep", "601"])
        self.shell = subprocess.Popen("trap '' TERM; sleep 602 & wait; sleep 603", shell=True)
"""
DETACHED = """
import subprocess
from busflow import Node


class Parent(Node):
    async def start(self) -> None:
        subprocess.Popen(["sleep", "604"], start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
"""
TEST = """
from busflow.testing import harness, virtual_time


@virtual_time
async def test_parent() -> None:
    async with harness("run.yaml") as lab:
        await lab.advance(1)
"""
COMMANDS = {
    "run": ["busflow", "run", "run.yaml", "--for", "0.2s"],
    "run --sim": ["busflow", "run", "run.yaml", "--for", "0.2s", "--sim"],
    "worker": ["busflow", "run", "worker.yaml", "--for", "0.2s"],
    "test": ["busflow", "test", "run.yaml", "--for", "1s"],
    "check": ["busflow", "check", "run.yaml"],
    "config": ["busflow", "config", "run.yaml"],
    "pytest": ["pytest", "-q", "-p", "no:cacheprovider", "test_parent.py"],
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "plugins").mkdir()
    (tmp_path / "plugins/parent.py").write_text(NODE)
    text = "name: family\nplugins: [plugins]\nnodes: {parent: {plugin: parent"
    (tmp_path / "run.yaml").write_text(f"{text}}}}}\n")
    (tmp_path / "worker.yaml").write_text(f"{text}, process: own}}}}\nprocesses: {{own: {{}}}}\n")
    (tmp_path / "test_parent.py").write_text(TEST)
    return tmp_path


def run(folder: Path, command: str, *words: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run to the end of the output, which any process that is left would hold."""
    return subprocess.run(
        [sys.executable, "-m", *COMMANDS[command], *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": "", "PYTEST_ADDOPTS": "", **environment},
        capture_output=True,
        text=True,
        timeout=60,
    )


def sleepers(folder: Path) -> list[str]:
    """Return the commands of the processes that run in a folder."""
    found = []
    for status in Path("/proc").glob("[0-9]*"):
        try:
            if (status / "cwd").resolve() == folder.resolve():
                found.append((status / "cmdline").read_text().replace("\0", " "))
        except OSError:
            continue
    return found


@pytest.mark.parametrize("command", COMMANDS)
def test_no_child_outlives_the_command(command, folder):
    if command == "pytest":  # what the import of a plugin starts belongs to the test session
        (folder / "plugins/parent.py").write_text(NODE.replace('EARLY = subprocess.Popen(["sleep", "600"])', ""))
    ended = run(folder, command)
    assert (ended.returncode, sleepers(folder)) == (0, []), ended.stderr


@pytest.mark.parametrize("command", ["run", "worker", "test", "pytest"])
def test_a_child_with_a_session_of_its_own_is_named_once(command, folder):
    (folder / "plugins/parent.py").write_text(DETACHED)
    ended = run(folder, command, *(["-s"] if command == "pytest" else []))
    lines = [line for line in (ended.stdout + ended.stderr).splitlines() if "goes on after the run" in line]
    assert (ended.returncode, len(lines)) == (0, 1), ended.stderr
    pid = next(int(word) for word in lines[0].split() if word.isdecimal())
    os.kill(pid, signal.SIGKILL)


def test_children_from_before_the_command_go_on(folder):
    script = f"sleep 605 >&- 2>&- & echo $!; exec {sys.executable} -m busflow run run.yaml --for 0.2s > run.log 2>&1"
    ended = subprocess.run(["bash", "-c", script], cwd=folder, capture_output=True, text=True, timeout=60)
    left = sleepers(folder)
    os.kill(int(ended.stdout), signal.SIGKILL)
    assert (ended.returncode, left) == (0, ["sleep 605 "])
