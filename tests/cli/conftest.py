"""Small launch files with two nodes each: one in a folder of its own, and one that runs while commands look at it."""

import json
import os
import pty
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import termios
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import pytest

import busflow
from busflow.cli import main
from busflow.text import printable
from tests.golden import Golden, masked

LABS = Path(__file__).parent / "labs"
"""Launch files that commands look at, with their nodes in `plugins/`."""
ROOT = Path(__file__).parents[2]


@pytest.fixture
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a launch file of a talker and a listener, which a test may change, as the working directory."""
    (tmp_path / "plugins").mkdir()
    for name in ("talk.yaml", "plugins/talker.py", "plugins/listener.py"):
        shutil.copy(LABS / name, tmp_path / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def edit(old: str, new: str, file: str = "talk.yaml") -> None:
    """Replace a text in a file of the project."""
    text = Path(file).read_text("utf-8")
    assert old in text
    Path(file).write_text(text.replace(old, new), "utf-8")


def append(text: str, file: str = "talk.yaml") -> None:
    """Append lines to a file of the project."""
    with Path(file).open("a", encoding="utf-8") as stream:
        stream.write(text)


class Shell:
    """Command lines that run in this process; the golden text of the test has each with its output."""

    def __init__(self, capsys: pytest.CaptureFixture[str], mask: Mapping[str, str]) -> None:
        self.out = self.err = self.shown = ""
        self._capsys, self._mask = capsys, mask

    def __call__(self, line: str, *words: str, mask: Mapping[str, str] | None = None) -> int:
        """Run a command line, with more words that may have blanks; return the exit code."""
        arguments = [*shlex.split(line), *words]
        self._capsys.readouterr()
        code = main(arguments)
        self.out, self.err = self._capsys.readouterr()
        errors = f"--- errors\n{self.err}" if self.err else ""
        self.note(f"$ busflow {printable(shlex.join(arguments))}\n{self.out}{errors}", mask=mask)
        return code

    def note(self, text: str, *, mask: Mapping[str, str] | None = None) -> None:
        """Add a text to those that are compared, e.g. the output of a command in a process of its own."""
        place = {re.escape(os.environ["BUSFLOW_RUNTIME_DIR"]): "RUNTIME"}
        self.shown += masked(text, {**self._mask, **place, **(mask or {})}) + "\n"

    def text(self, line: str, *words: str, code: int | None = 0) -> str:
        """Run a command line and return its output, of which nothing is compared."""
        self._capsys.readouterr()
        found = main([*shlex.split(line), *words])
        assert code in (found, None)
        return self._capsys.readouterr().out

    def data(self, line: str, *words: str, code: int | None = 0) -> Any:
        """Run a command line with `--json` and return its answer."""
        return json.loads(self.text(line, *words, "--json", code=code))


@pytest.fixture
def shell(capsys: pytest.CaptureFixture[str], golden: Golden, monkeypatch: pytest.MonkeyPatch) -> Iterator[Shell]:
    """`assert shell("check talk.yaml") == 3`: the golden text of the test has the command line and its output."""
    monkeypatch.setenv("COLUMNS", "80")
    places = {str(Path(busflow.__file__).parent): "BUSFLOW", sys.prefix: "PREFIX", str(ROOT): "PROJECT"}
    found = Shell(capsys, {re.escape(path): shown for path, shown in places.items()})
    yield found
    if found.shown:
        golden(found.shown)


@pytest.fixture
def completed(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Callable[[str], list[str]]:
    """Return a function for the words that the tab key offers after a command line, in bash."""

    def offered(words: str) -> list[str]:
        with monkeypatch.context() as patch:
            patch.setenv("_BUSFLOW_COMPLETE", "bash_complete")
            patch.setenv("COMP_WORDS", f"busflow {words}")
            patch.setenv("COMP_CWORD", str(len(words.split(" "))))
            main([])
        out, err = capsys.readouterr()
        assert err == ""
        return [line.partition(",")[2] for line in out.splitlines() if line]

    return offered


class LiveRun:
    """A `busflow run` in a process of its own; what it logs is kept."""

    def __init__(self, folder: Path, *arguments: str, environment: Mapping[str, str]) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-m", "busflow", "run", *arguments],
            cwd=folder,
            env={**environment},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.lines: list[str] = []
        self._arrived = threading.Condition()
        self._ended = False
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self) -> None:
        assert self.process.stderr is not None
        with self.process.stderr as stream:
            for line in stream:
                with self._arrived:
                    self.lines.append(line)
                    self._arrived.notify_all()
        with self._arrived:
            self._ended = True
            self._arrived.notify_all()

    def wait_for(self, text: str) -> None:
        """Wait until it has logged a line with this text."""
        with self._arrived:
            self._arrived.wait_for(lambda: self._ended or any(text in line for line in self.lines), timeout=60)
        assert any(text in line for line in self.lines), self.lines

    def stop(self) -> None:
        """Press Ctrl-C, and wait for its end."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGCONT)
            self.process.send_signal(signal.SIGINT)
            try:
                self.process.wait(timeout=60)
            finally:
                self.process.kill()  # or it would be there for the tests that follow
        self._reader.join(timeout=60)


class Place:
    """A runtime directory of its own, short enough for a socket, which pytest's own are not."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(path)}

    def run(self, folder: Path, *arguments: str) -> LiveRun:
        """Start a run in this runtime directory."""
        return LiveRun(folder, *arguments, environment=self.environment)

    def look(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """Let commands of this process find the runs of this directory, and no others."""
        monkeypatch.setenv("BUSFLOW_RUNTIME_DIR", str(self.path))


@contextmanager
def standing(launch_file: Path, *options: str) -> Iterator[tuple[Place, LiveRun]]:
    """Run a launch file in a place of its own while the block lasts."""
    with tempfile.TemporaryDirectory(prefix="busflow-", dir="/tmp") as path:
        place = Place(Path(path))
        run = place.run(launch_file.parent, launch_file.name, *options)
        try:
            yield place, run
        finally:
            run.stop()


@pytest.fixture(scope="module")
def stand() -> Iterator[Callable[[Path], tuple[Place, LiveRun]]]:
    """Return a function that starts a run in a place of its own, for all tests of a module, which do not change it."""
    with ExitStack() as stack:
        yield lambda launch_file: stack.enter_context(standing(launch_file))


@pytest.fixture(scope="session")
def imu_lab(lasting: set[int]) -> Iterator[Place]:
    """The place of a run of the lab of ROS 2's captures, for the whole session."""
    # The watchdog would log a busy machine, in a log that is compared.
    with standing(LABS / "imu_lab.yaml", "-v", "--watchdog", "off") as (place, run):
        lasting.add(run.process.pid)
        run.wait_for("works")
        yield place


@pytest.fixture
def lab(imu_lab: Place, monkeypatch: pytest.MonkeyPatch) -> Place:
    """The running lab, found by commands of this process."""
    imu_lab.look(monkeypatch)
    return imu_lab


@pytest.fixture(scope="module")
def odd_lab() -> Iterator[Place]:
    """The place of the run with the odd topics; it takes much of a processor, so it ends with the module."""
    with standing(LABS / "odd_lab.yaml") as (place, run):
        run.wait_for("ready")
        yield place


@pytest.fixture
def odds(odd_lab: Place, monkeypatch: pytest.MonkeyPatch) -> Place:
    """The run with the odd topics, found by commands of this process."""
    odd_lab.look(monkeypatch)
    return odd_lab


@pytest.fixture(scope="module")
def lab1() -> Iterator[tuple[Place, LiveRun]]:
    """The place of a run of the project's own lab, for all tests of a module."""
    with standing(ROOT / "configs/lab1.yaml") as (place, run):
        run.wait_for("All sensors operational")
        yield place, run


@pytest.fixture
def place(monkeypatch: pytest.MonkeyPatch) -> Iterator[Place]:
    """An empty place, where commands of this process look for runs."""
    with tempfile.TemporaryDirectory(prefix="busflow-", dir="/tmp") as path:
        found = Place(Path(path))
        found.look(monkeypatch)
        yield found


@pytest.fixture
def start_run(place: Place) -> Iterator[Callable[..., LiveRun]]:
    """Return a function that starts runs in that place; they are stopped after the test."""
    with ExitStack() as started:

        def start(folder: Path, *arguments: str) -> LiveRun:
            run = place.run(folder, *arguments)
            started.callback(run.stop)
            return run

        yield start


ROS2 = Path(__file__).parents[1] / "cases/ros2cli"
_ROS_ALONE = ("rcl_interfaces/", "type_description", "use_sim_time")
"""Topics, parameters and services that every node of ROS 2 has and ours do not."""


@pytest.fixture
def ros2_said() -> Callable[[str], str]:
    """Return the output of a ROS 2 command in the same lab, without what only ROS 2's nodes have."""

    def said(name: str) -> str:
        lines = (ROS2 / f"{name}.txt").read_text(encoding="utf-8").splitlines()[1:-1]
        return "".join(f"{line}\n" for line in lines if not any(word in line for word in _ROS_ALONE))

    return said


@pytest.fixture
def ros2_file() -> Callable[[str], str]:
    """Return the whole output of a ROS 2 command in the same lab."""

    def read(name: str) -> str:
        return "".join(f"{line}\n" for line in (ROS2 / f"{name}.txt").read_text(encoding="utf-8").splitlines()[1:-1])

    return read


@pytest.fixture
def in_terminal() -> Callable[..., list[str]]:
    """Return a function that runs a command in a terminal of some width and returns the printed lines."""

    def run(columns: int, *arguments: str) -> list[str]:
        screen, terminal = pty.openpty()
        termios.tcsetwinsize(terminal, (24, columns))
        environment = {key: value for key, value in os.environ.items() if key not in ("COLUMNS", "NO_COLOR")}
        command = [sys.executable, "-m", "busflow", *arguments]
        shown = bytearray()
        with subprocess.Popen(
            command, stdout=terminal, stderr=subprocess.DEVNULL, env={**environment, "TERM": "xterm"}
        ) as process:
            os.close(terminal)
            with suppress(OSError):  # how Linux reports a closed terminal
                while part := os.read(screen, 65536):
                    shown += part
        os.close(screen)
        assert process.returncode == 0
        return re.sub(r"\x1b\[[0-9;]*m", "", shown.decode()).splitlines()

    return run
