"""Runs to look into: one of a test's own graph, and ones in processes of their own."""

import asyncio
import os
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import asynccontextmanager, suppress
from textwrap import dedent
from typing import Any

import pytest

from busflow import launch
from busflow.wire.client.client import Peer
from busflow.wire.zenoh.run_directory import find_run

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
        self.process = subprocess.Popen(
            [sys.executable, "-c", script], stderr=subprocess.PIPE, text=True, start_new_session=True
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


class Looked:
    """A graph of this process that runs, and a peer that has joined it."""

    def __init__(self, graph: Any, peer: Peer) -> None:
        self.graph, self.peer = graph, peer

    async def ask(self, act: Callable[..., Any], *arguments: Any, **words: Any) -> Any:
        """Have the peer do something, while the graph's loop goes on."""
        return await asyncio.to_thread(act, *arguments, **words)

    async def until(self, condition: Callable[[], Any]) -> Any:
        """Wait until something is so, which the loop has to come round to."""
        async with asyncio.timeout(PATIENCE_S):
            while not (found := condition()):  # noqa: ASYNC110  # it is others who make it so, with no event to set
                await asyncio.sleep(0.005)
        return found


@pytest.fixture
def looked_at():
    """`async with looked_at(*nodes) as looked`: a graph that a peer looks into."""

    @asynccontextmanager
    async def start(*nodes: Any, name: str = "looked"):
        async with launch(*nodes, inspect=name) as graph:
            peer = await asyncio.to_thread(lambda: Peer(find_run(name)))
            try:
                yield Looked(graph, peer)
            finally:
                await asyncio.to_thread(peer.close)

    return start
