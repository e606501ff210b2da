"""Processes: how long a message takes from one process into a handler of another one, and how many go through."""

from __future__ import annotations

import asyncio
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from benchmarks.crossing import FLOOD, HELLO, RING, SIZES, payload
from benchmarks.crossing.board import Board
from benchmarks.crossing.conductor import Conductor
from benchmarks.crossing.links import LINKS
from benchmarks.question import Case, Contender, Effort, Question, Quoted, Sample
from benchmarks.rounds import ROOT
from busflow.runner.loops.system import new_event_loop

PATIENCE_S = 60.0
NODES = ROOT / "benchmarks/crossing/nodes"
LAUNCH_FILE = """\
name: crossing
plugins: [{nodes}]
processes:
  far:
nodes:
  sender:
    plugin: crossing_sender
    parameters: {{kind: {kind}, size: {size}, seconds: {seconds}, folder: {folder}}}
  receiver:
    plugin: crossing_receiver
    process: far
    parameters: {{kind: {kind}, folder: {folder}}}
"""


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """Latency at a steady rate, then what goes through, over one way."""
    size = SIZES[case]
    seconds = 0.4 if not effort.is_quick else 0.1
    # The path of a socket must be short, which not every system's own folder for such files lets it be.
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder:
        if isinstance(contender.way, dict):
            return run_nodes(Path(folder), contender.way[case], size, seconds)
        with asyncio.Runner(loop_factory=new_event_loop) as runner:  # which waits as precisely as busflow's own
            return runner.run(_link(contender, Path(folder), size, seconds))


async def _link(contender: Contender, folder: Path, size: int, seconds: float) -> Sample:
    board = Board(folder / "board")
    link: Any = LINKS[contender.name](folder, size)
    awaits = contender.way == "awaits"
    ring = [payload(size, number) for number in range(RING)]
    async with link.sender() as publish:
        command = [sys.executable, "-m", "benchmarks.crossing.links", contender.name, str(folder), str(size)]
        receiver = subprocess.Popen(command, cwd=ROOT)  # noqa: ASYNC220, S603  # nothing else waits for this loop
        conductor = Conductor(board, publish, ring, payload(size, FLOOD), payload(size, HELLO), awaits=awaits)
        try:
            return await conductor.run(size, seconds)
        finally:
            board.finish()
            receiver.kill()
            receiver.wait()


def run_nodes(folder: Path, kind: str, size: int, seconds: float, *options: str) -> Sample:
    """Two nodes in two processes of a run, as a launch file places them."""
    return run_launch_file(
        folder, LAUNCH_FILE.format(nodes=NODES, kind=kind, size=size, seconds=seconds, folder=folder), *options
    )


def run_launch_file(folder: Path, text: str, *options: str) -> Sample:
    """The figures that a node of a run writes down."""
    file = folder / "crossing.yaml"
    file.write_text(text)
    (folder / "run").mkdir(mode=0o700)
    environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": str(folder / "run"), "PYTHONPATH": str(ROOT)}
    run = subprocess.Popen(  # noqa: S603  # our own command
        [sys.executable, "-m", "busflow", "run", str(file), "--watchdog", "off", *options],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.DEVNULL,
    )
    try:
        return _found(folder / "found.json", run)
    finally:
        run.send_signal(signal.SIGINT)
        run.wait(PATIENCE_S)


def _found(file: Path, run: subprocess.Popen[bytes]) -> Sample:
    until = time.perf_counter() + PATIENCE_S
    while not file.exists():
        if run.poll() is not None or time.perf_counter() > until:
            raise RuntimeError("the run has ended without figures")
        time.sleep(0.02)
    found = json.loads(file.read_text())
    if "failed" in found:
        raise RuntimeError(found["failed"])
    return found


_BYTES = {"8 B": "number", "320 B": "block", "64 KB": "image", "1 MB": "image", "6 MB": "image"}
_WHOLE = dict.fromkeys(("64 KB", "1 MB", "6 MB"), "whole image")
CASES = [Case(name, name, "") for name in SIZES]

QUESTION = Question(
    name="processes",
    title="Between two processes",
    explanation=(
        "From publish to the entry of the handler at a steady rate (1 kHz; 200 Hz for 1 MB, 40 Hz for 6 MB), wall "
        "time; then how many a second arrive when no more than 2,048 (64 of 64 KB, 12 of 1 MB, 6 of 6 MB) may be "
        "under way, and the CPU time of both processes for each. busflow hands a message to a node's handler: Int64, "
        "UInt8MultiArray, and Image from 64 KB on, which goes through shared memory. The others hand over bytes. The "
        "floor: bytes copied into shared memory, a byte through a pipe, and copied out."
    ),
    cases=CASES,
    contenders=[
        Contender("busflow", _BYTES),
        Contender("busflow, Imu", {"320 B": "imu"}, cases=frozenset({"320 B"})),
        Contender("busflow, whole", _WHOLE, cases=frozenset(_WHOLE), note="through the socket"),
        Contender("Zenoh", needs=("zenoh",), note="raw, into a callback"),
        Contender("Zenoh, direct", needs=("zenoh",), note="called by the link's thread"),
        Contender("Zenoh, asyncio", needs=("zenoh",), note="onto an event loop, bytes"),
        Contender("pyzmq", needs=("zmq",), note="PUB/SUB, ipc, blocking"),
        Contender("ezmsg", "awaits", needs=("ezmsg",)),
        Contender("asyncio unix socket", "awaits", note="streams"),
        Contender("shared memory", note="the floor"),
    ],
    measure=measure,
    quick=frozenset({"320 B", "64 KB"}),  # one of each way: through the socket, and through shared memory
    quoted=(
        Quoted(
            "rclpy, SingleThreadedExecutor",
            {("8 B", "p50 s"): 221e-6, ("8 B", "p99 s"): 539e-6, ("8 B", "rate /s"): 5_400,
             ("320 B", "p50 s"): 280e-6, ("320 B", "p99 s"): 988e-6, ("320 B", "rate /s"): 4_780,
             ("1 MB", "p50 s"): 2568e-6, ("1 MB", "p99 s"): 3868e-6, ("1 MB", "rate /s"): 387},
        ),
        Quoted(
            "rclpy, EventsExecutor",
            {("8 B", "p50 s"): 136e-6, ("8 B", "p99 s"): 328e-6, ("8 B", "rate /s"): 63_872,
             ("320 B", "p50 s"): 193e-6, ("320 B", "p99 s"): 402e-6, ("320 B", "rate /s"): 25_468,
             ("1 MB", "p50 s"): 2435e-6, ("1 MB", "p99 s"): 3852e-6, ("1 MB", "rate /s"): 412},
        ),
    ),
    quoted_from=(
        "rclpy cannot be installed with pip: its figures (7.1.9, ROS 2 Jazzy, Cyclone DDS; Float64, Imu, Image; 100 Hz "
        "for 1 MB) were measured once on an idle virtual machine of two cores. Its publisher was not held back: 29 to "
        "96 % got lost of what it sent to reach these rates."
    ),
)  # fmt: skip
