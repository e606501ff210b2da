"""Runs to look into, in processes of their own."""

import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from busflow.timeouts import VARIABLE

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

NODES = Path(__file__).parents[1] / "nodes"


class Robot:
    """A run in a process of its own, with all nodes of a file."""

    def __init__(self, file: str, name: str = "robot", *, overtaken: str = "0.5") -> None:
        """Start it; its log is read by `wait_for`. With `overtaken="inf"` the session stays open after large messages.

        Its end, and the way to a new subscription, take as long as others need, on however slow a machine.
        """
        self.name = name
        limits = f"{os.environ[VARIABLE]},grace=inf,last_messages=inf,held_messages=inf,overtaken={overtaken}"
        self.process = subprocess.Popen(
            [sys.executable, NODES / "run_nodes.py", NODES / file, name],
            env={**os.environ, VARIABLE: limits, "PYTHONPATH": str(NODES.parents[1])},
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )

    def wait_for(self, text: str) -> str:
        """Read the log until a line holds this; that line."""
        told = []
        for line in self.process.stderr:
            told.append(line)
            if text in line:
                return line
        raise AssertionError(f"{text!r} was never said; the log: {''.join(told)}")

    def ready(self) -> "Robot":
        """Wait until a node has logged `ready`."""
        self.wait_for("ready")
        return self

    def signal(self, number: int) -> None:
        os.kill(self.process.pid, number)

    def end(self) -> tuple[int, str]:
        """Press Ctrl-C, and return the exit code and the rest of the log."""
        self.signal(signal.SIGINT)
        rest = self.process.stderr.read()
        return self.process.wait(PATIENCE_S), rest

    def kill(self) -> None:
        """End it and whatever it started."""
        with suppress(ProcessLookupError):
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait(PATIENCE_S)
        self.process.stderr.close()


@pytest.fixture
def robots() -> Iterator[Callable[..., Robot]]:
    """Starts runs, which end with the test."""
    started: list[Robot] = []

    def start(file: str, name: str = "robot", **limits: str) -> Robot:
        started.append(Robot(file, name, **limits))
        return started[-1]

    yield start
    for each in started:
        each.kill()
