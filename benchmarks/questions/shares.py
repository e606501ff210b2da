"""Shares: how much of one processor core, and of the memory, a robot's graph takes while it runs."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.crossing.board import cpu_s
from benchmarks.question import Case, Contender, Effort, Question, Quoted, Sample
from benchmarks.rounds import ROOT
from busflow.wire.zenoh.run_directory import runs

PATIENCE_S = 30.0
SETTLED_S = 1.5
"""By when every node has started and found what it needs, also on a busy machine."""


def measure(contender: Contender, _case: str, effort: Effort) -> Sample:
    """The CPU time of `busflow run` over some seconds, once it has started."""
    seconds = 0.3 if effort.is_quick else 3.0
    command = [sys.executable, "-m", "busflow", "run", *contender.way]
    # The path of a socket must be short, which not every system's own folder for such files lets it be.
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder:
        run = subprocess.Popen(  # noqa: S603  # our own command
            command,
            cwd=ROOT,
            env={**os.environ, "BUSFLOW_RUNTIME_DIR": folder},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            _await_start(run, Path(folder))
            time.sleep(0 if effort.is_quick else SETTLED_S)
            began, before_s = time.perf_counter(), cpu_s(run.pid)
            time.sleep(seconds)
            share = 100 * (cpu_s(run.pid) - before_s) / (time.perf_counter() - began)
            return {"%": share, "resident B": resident_bytes(run.pid)}
        finally:
            run.send_signal(signal.SIGINT)
            run.wait()


def resident_bytes(pid: int) -> float:
    """The memory that a process has now: Linux counts it in pages."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def _await_start(run: subprocess.Popen[bytes], folder: Path) -> None:
    """Wait until it can be looked into."""
    until = time.perf_counter() + PATIENCE_S
    while not runs({"BUSFLOW_RUNTIME_DIR": str(folder)}):
        if run.poll() is not None or time.perf_counter() > until:
            raise RuntimeError(f"it has not started: {run.args}")
        time.sleep(0.05)


RUNNING = "while it runs"
QUESTION = Question(
    name="shares",
    title="Share of a processor core, and memory",
    explanation="`busflow run` of the project's own configurations, on real time, open to other terminals.",
    cases=[Case(RUNNING, "CPU time by time")],
    contenders=[
        Contender("busflow, the lab", ("configs/lab1.yaml",), note="2 nodes, 10 Hz"),
        Contender("busflow, the lab at 100 Hz", ("configs/lab1.yaml", "rate_hz:=100")),
        Contender("busflow, the humanoid", ("configs/humanoid.yaml",), note="31 joints, 100 Hz"),
    ],
    measure=measure,
    quoted=(Quoted("rclpy, the lab, two processes", {(RUNNING, "%"): 2.6}),),
    quoted_from="rclpy (7.1.9, ROS 2 Jazzy): the same two nodes at 10 Hz on an idle machine, each its own process.",
)
