"""Runs of several processes, for real: what they log is read as it comes, and what they came to from their report."""

import io
import json
import os
import select
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any

import pytest

from busflow.cli import main

PATIENCE_S = 120.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

GRACE = "20s"
"""What nodes have to stop, on however slow a machine: a run that is ended by force fails."""

NODES = Path(__file__).parents[1] / "nodes"
"""Where the nodes are that launch files name."""
COMMAND = ["-m", "busflow", "run", "run.yaml", "--log-format", "json"]


def busflow(runtime: Path, *words: str, expect: Sequence[int] = (0,)) -> str:
    """Return the output of a command that looks for runs in this folder, and ends with one of these codes.

    It is executed in this process, since an interpreter takes longer to start than most commands take.
    """
    printed = io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True)
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed), redirect_stderr(printed):
        patch.setenv("BUSFLOW_RUNTIME_DIR", str(runtime))
        code = main(words)
    text = printed.buffer.getvalue().decode()
    assert code in expect, (words, code, text)
    return text


class Run:
    """A `busflow run`, or a script, in a process of its own."""

    def __init__(
        self,
        folder: Path,
        runtime: Path,
        *arguments: str,
        script: str | None = None,
        report: str = "out.json",
        prefix: Sequence[str] = (),
    ) -> None:
        """Start it: its runs are found in `runtime`, and `prefix` is what the system is asked to start it with."""
        self.folder, self.runtime, self._report = folder, runtime, report
        command = [*COMMAND, "--report", report] if script is None else [script]
        self.process = subprocess.Popen(
            [*prefix, sys.executable, *command, *arguments],
            cwd=folder,
            env={**os.environ, "BUSFLOW_RUNTIME_DIR": str(runtime)},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        self.lines: list[str] = []
        self.printed: list[str] = []
        self._arrived = threading.Condition()
        self._open = 2
        self._readers = [
            threading.Thread(target=self._read, args=(stream, into), daemon=True)
            for stream, into in ((self.process.stderr, self.lines), (self.process.stdout, self.printed))
        ]
        for reader in self._readers:
            reader.start()

    def _read(self, stream: Any, into: list[str]) -> None:
        with stream:
            for line in stream:
                with self._arrived:
                    into.append(line)
                    self._arrived.notify_all()
        with self._arrived:
            self._open -= 1
            self._arrived.notify_all()

    def wait_for(self, *texts: str, times: int = 1) -> None:
        """Wait until so many lines with all of these texts were logged."""

        def count() -> int:
            return sum(all(text in line for text in texts) for line in self.lines)

        with self._arrived:
            self._arrived.wait_for(lambda: not self._open or count() >= times, timeout=PATIENCE_S)
        assert count() >= times, (texts, "".join(self.lines))

    def wait_for_more(self, event: str, *nodes: str, times: int) -> None:
        """Wait until each of these nodes has logged an event so often again."""
        texts = {node: (f'"{event}"', f'"/{node}"') for node in nodes}
        before = {node: sum(all(each in line for each in texts[node]) for line in self.lines) for node in nodes}
        for node in nodes:
            self.wait_for(*texts[node], times=before[node] + times)

    def log(self) -> list[dict[str, Any]]:
        """The lines of the log so far."""
        return [json.loads(line) for line in self.lines if line.startswith("{")]

    def pids(self) -> dict[str, int]:
        """The other processes, by name, as they were started last."""
        return {
            each["event"].split()[2]: each["pid"]
            for each in self.log()
            if each["event"].startswith("the process ") and "pid" in each and "is started" in each["event"]
        }

    def kill(self, process: str, number: int = signal.SIGKILL) -> None:
        os.kill(self.pids()[process], number)

    def busflow(self, *words: str, expect: int = 0) -> str:
        """Return the output of a command of another terminal."""
        return busflow(self.runtime, *words, expect=(expect,))

    def end(self, number: int | None = signal.SIGINT) -> int:
        """Ask it to end, unless it does so by itself, and wait for that."""
        if number is not None and self.process.poll() is None:
            self.process.send_signal(number)
        code = self.process.wait(PATIENCE_S)
        for reader in self._readers:
            reader.join(PATIENCE_S)
        return code

    def report(self) -> dict[str, Any]:
        """What the run came to."""
        return json.loads((self.folder / self._report).read_text())

    def topic(self, name: str) -> dict[str, Any]:
        (found,) = [topic for topic in self.report()["topics"] if topic["name"] == name]
        return found


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Where runs are started, and write."""
    return tmp_path


@pytest.fixture
def start(project: Path) -> Iterator[Callable[..., Run]]:
    """Starts runs of a launch file, and ends whatever is left of them."""
    with starting(project) as start:
        yield start


@pytest.fixture(scope="module")
def start_for_all(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Run]]:
    """The same, for runs that last as long as the file's tests do: they only look at them."""
    with starting(tmp_path_factory.mktemp("run")) as start:
        yield start


@contextmanager
def starting(folder: Path) -> Iterator[Callable[..., Run]]:
    started: list[Run] = []
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as runtime:

        def start(
            text: str,
            *arguments: str,
            files: Mapping[str, str] = {},
            script: str | None = None,
            machine: str = "",
            prefix: Sequence[str] = (),
            grace: str = GRACE,
        ) -> Run:
            for name, content in files.items():
                (folder / name).write_text(content)
            (folder / "run.yaml").write_text(f"plugins: [{NODES}]\nshutdown: {{grace: {grace}}}\n{text}")
            place = Path(runtime, machine)
            place.mkdir(mode=0o700, exist_ok=True)
            if machine not in {"", "main"}:
                arguments = ("--machine", machine, *arguments)
            report = f"out{machine}.json"
            started.append(Run(folder, place, *arguments, script=script, report=report, prefix=prefix))
            return started[-1]

        yield start
        for run in started:
            if run.process.poll() is None:
                run.process.kill()
            run.end(None)
        left = {path.name for run in started for path in run.runtime.iterdir()} - {".lock", "main", "arm", "head"}
        assert not left or any(each.process.returncode == -signal.SIGKILL for each in started)


def ended(pids: list[int], within_s: float) -> bool:
    """Whether all of these processes, which are nobody's children here, end in time."""
    left = []
    for pid in pids:
        try:
            left.append(os.pidfd_open(pid))
        except ProcessLookupError:
            continue
    try:
        while left:
            ready, _, _ = select.select(left, [], [], within_s)
            if not ready:
                return False
            for each in ready:
                left.remove(each)
                os.close(each)
        return True
    finally:
        for each in left:
            os.close(each)


@pytest.fixture
def have_ended() -> Callable[[list[int], float], bool]:
    return ended
