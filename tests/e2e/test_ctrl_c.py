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

NODES = {
    "polite": """
        @timer(0.01)
        def tick(self) -> None:
            self.log.info("ticking")

        async def stop(self) -> None:
            self.log.info("closed the device")
    """,
    "busy": """
        @timer(0.01)
        def tick(self) -> None:
            self.log.info("ticking")
            while True:
                pass
    """,
    "busy_at_once": """
        async def run(self) -> None:
            self.log.info("ticking")
            while True:
                pass
    """,
    "asleep": """
        @timer(0.01)
        def tick(self) -> None:
            self.log.info("ticking")
            time.sleep(3600)
    """,
    "deaf": """
        @timer(0.01)
        def tick(self) -> None:
            threading.Timer(0.1, self.log.info, ["ticking"]).start()
            libc, lock = ctypes.CDLL(None), ctypes.create_string_buffer(128)
            libc.pthread_mutex_init(lock, None)
            libc.pthread_mutex_lock(lock)
            libc.pthread_mutex_lock(lock)  # for ever, in C, which no signal ends
    """,
    "slow_to_stop": """
        @timer(0.01)
        def tick(self) -> None:
            self.log.info("ticking")

        async def stop(self) -> None:
            await asyncio.sleep(0.2)  # longer than one signal may be sent twice
            self.log.info("stopping")
            await asyncio.sleep(3600)
    """,
    "thread": """
        async def run(self) -> None:
            self.log.info("ticking")
            await self.run_sync(time.sleep, 3600)
    """,
    "own_signal": """
        async def start(self) -> None:
            asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, self.heard)
            self.log.info("ticking")

        def heard(self) -> None:
            self.log.info("heard the signal")
    """,
    "pool": """
        async def run(self) -> None:
            self.log.info("ticking")
            await asyncio.to_thread(time.sleep, 3600)
    """,
    "starting": """
        async def start(self) -> None:
            self.log.info("ticking")
            await asyncio.Event().wait()
    """,
}


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
    (tmp_path / "plugins").mkdir()
    imports = "import asyncio, ctypes, signal, threading, time\nfrom busflow import Node, timer\n"
    code = f"{imports}\nclass Plugin(Node):\n{NODES[name]}"
    (tmp_path / "plugins" / f"{name}.py").write_text(code.replace("\n    ", "\n"))
    (tmp_path / "launch.yaml").write_text(f"plugins: [plugins]\nnodes:\n  {name}:\n    plugin: {name}\n")
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


@pytest.mark.parametrize("terminal", ["polite"], indirect=True)
def test_sigterm_stops_the_nodes_too(terminal: Terminal):
    terminal.read_until("ticking")
    terminal.process.send_signal(signal.SIGTERM)
    assert terminal.end() == 143
    assert "closed the device" in terminal.shown


@pytest.mark.parametrize("terminal", ["polite"], indirect=True)
def test_closed_terminal_stops_the_nodes_too(terminal: Terminal):
    terminal.read_until("ticking")
    terminal.process.send_signal(signal.SIGHUP)
    assert terminal.end() == 129
    assert "closed the device" in terminal.shown


@pytest.mark.long
@pytest.mark.parametrize(
    ("terminal", "told"),
    [
        ("busy", "plugins/busy.py:"),
        ("asleep", "plugins/asleep.py:"),
        *on_each_loop("deaf", "plugins/deaf.py:"),
        ("slow_to_stop", "/slow_to_stop did not stop within 0.75 s, and is given up"),
        ("thread", "exit code 130"),
        *on_each_loop("pool", "exit code 130"),
        ("starting", "exit code 130"),
    ],
    indirect=["terminal"],
    ids=lambda value: value if value in NODES else "",
)
def test_ctrl_c_ends_and_names_a_stuck_node(terminal: Terminal, told: str):
    terminal.read_until("ticking")
    terminal.press_ctrl_c()
    assert terminal.end() == 130
    assert told in terminal.shown
    assert "Traceback" not in terminal.shown


@pytest.mark.long
@pytest.mark.parametrize(
    ("terminal", "told"),
    [((name, "--for", "0.2"), f"plugins/{name}.py:") for name in ("busy_at_once", "asleep")],
    indirect=["terminal"],
    ids=["busy_at_once", "asleep"],
)
def test_time_limit_ends_and_names_a_stuck_node(terminal: Terminal, told: str):
    assert terminal.end() == 1
    assert "ticking" in terminal.shown
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
@pytest.mark.parametrize("terminal", on_each_loop("own_signal"), indirect=True)
def test_node_signal_changes_nothing_for_ctrl_c(terminal: Terminal):
    terminal.read_until("ticking")
    terminal.process.send_signal(signal.SIGUSR1)
    terminal.read_until("heard the signal")
    terminal.press_ctrl_c()
    assert terminal.end() == 130
    assert "exit code 130" in terminal.shown
