"""Start-up: how long until a command answers, and until the first message is there."""

from __future__ import annotations

import os
import subprocess
import sys
import time

from benchmarks.question import Case, Contender, Effort, Question, Quoted, Sample
from benchmarks.rounds import ROOT

FIRST_MESSAGE = """
import asyncio, busflow
from busflow.msgs.sensor_msgs import Imu
class Source(busflow.Node):
    imu = busflow.publisher(Imu, "imu")
class Sink(busflow.Node):
    @busflow.subscription("imu")
    def hear(self, imu: Imu) -> None:
        heard.set()
heard = asyncio.Event()
async def main():
    async with busflow.launch(Source, Sink) as graph:
        graph.node(Source).imu.publish(Imu())
        await heard.wait()
asyncio.run(main())
"""
QUEUE = """
import asyncio
async def main():
    queue = asyncio.Queue()
    queue.put_nowait(1)
    await queue.get()
asyncio.run(main())
"""


COMPILED = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
"""With what Python has compiled kept, as pip does for installed packages: else it would compile at every start."""


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """Wall and CPU time of a whole process; the best of a few, since nothing makes it faster than it is."""
    command = [sys.executable, *contender.way[case]]
    tries = [_once(command) for _ in range(1 if effort.is_quick else 3)]
    return {"wall s": min(wall for wall, _ in tries), "CPU s": min(cpu for _, cpu in tries)}


def _once(command: list[str]) -> tuple[float, float]:
    began = time.perf_counter()
    process = subprocess.Popen(  # noqa: S603  # our own interpreter
        command, cwd=ROOT, env=COMPILED, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    _, status, used = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise RuntimeError(f"exit code {process.returncode} of {' '.join(command)}")
    return time.perf_counter() - began, used.ru_utime + used.ru_stime


def importing(module: str, needs: str) -> Contender:
    """A package whose import alone is measured."""
    return Contender(f"import {module}", {"a program": ("-c", f"import {module}")}, (needs,), frozenset({"a program"}))


CLI = ("-m", "busflow")
CASES = [
    Case("--help", "Commands"),
    Case("check", "Commands"),
    Case("run, to its first message", "Commands"),
    Case("run, for 1 ms", "Commands"),
    Case("a program", "From nothing to the end"),
]

QUESTION = Question(
    name="startup",
    title="Start-up",
    explanation=(
        "A whole process, from its start to its end: commands on configs/lab1.yaml, one of which a node ends at the "
        "first message; a program that makes a graph and "
        "ends when its first message has arrived. Of peers, what importing them takes."
    ),
    cases=CASES,
    contenders=[
        Contender(
            "busflow",
            {
                "--help": (*CLI, "--help"),
                "check": (*CLI, "check", "configs/lab1.yaml"),
                "run, to its first message": (*CLI, "run", "benchmarks/starting/to_first_message.yaml"),
                "run, for 1 ms": (*CLI, "run", "configs/lab1.yaml", "--for", "1ms"),
                "a program": ("-c", FIRST_MESSAGE),
            },
            note="to the first message",
        ),
        Contender("Python alone", {"a program": ("-c", "pass")}, cases=frozenset({"a program"})),
        Contender("asyncio.Queue", {"a program": ("-c", QUEUE)}, cases=frozenset({"a program"})),
        Contender("import pydantic", {"a program": ("-c", "import pydantic")}, cases=frozenset({"a program"})),
        importing("ezmsg.core", "ezmsg"),
        importing("bubus", "bubus"),
        importing("faststream.nats", "faststream"),
        importing("cyclonedds.pub", "cyclonedds"),
    ],
    measure=measure,
    quick=frozenset({"--help", "run, to its first message", "a program"}),
    quoted=(Quoted("rclpy, import, one node, shutdown", {("a program", "wall s"): 0.172}),),
    quoted_from="rclpy: on an idle machine; see above.",
)
