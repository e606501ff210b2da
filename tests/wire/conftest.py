"""Runs to look into, in processes of their own."""

import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from textwrap import dedent

import pytest

from busflow.timeouts import VARIABLE

PATIENCE_S = 60.0
"""How long to wait for what must come, on however slow a machine; no measure of busflow."""

_PRELUDE = """
import asyncio, os, sys, threading
import numpy as np
import busflow
from busflow import *
from busflow.msgs.sensor_msgs import Image, Imu
from busflow.msgs.std_msgs import Float64, Int64, String
"""


class Robot:
    """A run in a process of its own, made of node classes whose source a test gives."""

    def __init__(self, source: str, name: str = "robot") -> None:
        """Start it; its nodes are the classes of the source, and its log is on `lines()`."""
        nodes = "[each for each in list(vars().values()) if isinstance(each, type) and issubclass(each, Node)]"
        script = f"{_PRELUDE}\n{dedent(source)}\nnodes = {nodes}\nnodes.remove(Node)\n"
        script += f"sys.exit(busflow.run(*nodes, inspect={name!r}))\n"
        self.name = name
        limits = f"{os.environ[VARIABLE]},grace=inf,last_messages=inf,overtaken=0.5"  # on however slow a machine
        self.process = subprocess.Popen(
            [sys.executable, "-c", script],
            env={**os.environ, VARIABLE: limits},
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

    def start(source: str, name: str = "robot") -> Robot:
        started.append(Robot(source, name))
        return started[-1]

    yield start
    for each in started:
        each.kill()


@pytest.fixture
def directory() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as name:  # the path of a socket has to be short
        yield Path(name)
