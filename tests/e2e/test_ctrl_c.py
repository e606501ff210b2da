"""The installed command in a real terminal: Ctrl-C ends whatever a node does, in order where it can, quietly."""

import os
import pty
import select
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytestmark = pytest.mark.e2e

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

NODES = Path(__file__).parents[1] / "nodes"


def on_each_loop(name: str, *text: str) -> list[Any]:
    """A node on busflow's own event loop, and, as a long test, on uvloop's; with the text that is expected."""
    marks = [pytest.mark.needs("uvloop"), pytest.mark.long]
    other = (name, "--event-loop", "uvloop")
    return [pytest.param(name, *text, id=name), pytest.param(other, *text, id=f"{name}-uvloop", marks=marks)]


class Terminal:
    """A `busflow run` in a terminal of its own."""

    def __init__(self, folder: Path, *options: str) -> None:
        self.mine, theirs = pty.openpty()
        command = [sys.executable, "-m", "busflow", "run", "launch.yaml", *options]
        self.process = subprocess.Popen(
            command, cwd=folder, stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True,
            preexec_fn=take_terminal,  # noqa: PLW1509  # there are no threads yet
        )  # fmt: skip
        os.close(theirs)
        self.shown = ""

    def read_until(self, text: str) -> None:
        while text not in self.shown:
            if not self.read():
                raise AssertionError(f"ended or silent without {text!r}; shown so far:\n{self.shown}")

    def read(self) -> bool:
        ready, _, _ = select.select([self.mine], [], [], PATIENCE_S)
        try:
            piece = os.read(self.mine, 65536) if ready else b""
        except OSError:  # how a Linux terminal says that nobody is at its other end
            piece = b""
        self.shown += piece.decode()
        return bool(piece)

    def press_ctrl_c(self) -> None:
        os.write(self.mine, b"\x03")

    def end(self) -> int:
        while self.read():
            pass
        return self.process.wait(PATIENCE_S)


def take_terminal() -> None:
    """In the child: make the pseudo-terminal the one whose Ctrl-C reaches it, and its end the child's too.

    Whoever runs the tests may have done so with `nohup`, which all their processes would inherit.
    """
    import fcntl
    import termios

    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)


@pytest.fixture
def terminal(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Terminal]:
    name, *options = request.param if isinstance(request.param, tuple) else (request.param,)
    plugin = f"interrupted:{name.title().replace('_', '')}"
    head = f"plugins: [{NODES}]\nshutdown: {{grace: 0.75}}\n"
    (tmp_path / "launch.yaml").write_text(f"{head}nodes: {{{name}: {{plugin: '{plugin}'}}}}\n")
    opened = Terminal(tmp_path, *options)
    yield opened
    opened.process.kill()
    opened.process.wait()
    os.close(opened.mine)


@pytest.mark.parametrize("terminal", on_each_loop("polite"), indirect=True)
def test_ctrl_c_stops_nodes_and_prints_the_account(terminal: Terminal):
    terminal.read_until("ticking")
    terminal.press_ctrl_c()
    assert terminal.end() == 130
    assert "closed the device" in terminal.shown
    assert "exit code 130" in terminal.shown
    assert "Traceback" not in terminal.shown


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP], ids=["asked to end", "terminal closed"])
@pytest.mark.parametrize("terminal", ["polite"], indirect=True)
def test_other_signals_stop_the_nodes_too(terminal: Terminal, number: int):
    terminal.read_until("ticking")
    terminal.process.send_signal(number)
    assert terminal.end() == 128 + number
    assert "closed the device" in terminal.shown


@pytest.mark.long
@pytest.mark.parametrize(
    ("terminal", "told"),
    [
        ("busy", "interrupted.py:"),
        ("asleep", "interrupted.py:"),
        *on_each_loop("deaf", "interrupted.py:"),
        ("slow_to_stop", "/slow_to_stop did not stop within 0.75 s, and is given up"),
        ("thread", "exit code 130"),
        ("pool", "exit code 130"),
        ("starting", "exit code 130"),
    ],
    indirect=["terminal"],
    ids=lambda value: "" if "." in value or " " in value else value,
)
def test_ctrl_c_ends_and_names_a_stuck_node(terminal: Terminal, told: str):
    terminal.read_until("ticking")
    terminal.press_ctrl_c()
    assert terminal.end() == 130
    assert told in terminal.shown
    assert "Traceback" not in terminal.shown


@pytest.mark.parametrize("terminal", ["slow_to_stop"], indirect=True)
def test_a_second_ctrl_c_ends_it_at_once(terminal: Terminal):
    terminal.read_until("ticking")
    terminal.press_ctrl_c()
    terminal.read_until("stopping")
    terminal.press_ctrl_c()
    assert terminal.end() == 130
    assert "a second signal" in terminal.shown or "given up" in terminal.shown
    assert "Traceback" not in terminal.shown


@pytest.mark.long
@pytest.mark.parametrize("terminal", ["own_signal"], indirect=True)
def test_node_signal_changes_nothing_for_ctrl_c(terminal: Terminal):
    terminal.read_until("ticking")
    terminal.process.send_signal(signal.SIGUSR1)
    terminal.read_until("got the signal")
    terminal.press_ctrl_c()
    assert terminal.end() == 130
    assert "exit code 130" in terminal.shown
