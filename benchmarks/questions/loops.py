"""Loops: what busflow costs, and how exact its timers are, on each event loop that it can have."""

from __future__ import annotations

import asyncio
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from statistics import median, quantiles

from benchmarks.crossing import SIZES
from benchmarks.peers.roster import BUSFLOW, InProcess
from benchmarks.question import Case, Contender, Effort, Question, Sample
from benchmarks.questions.delivery import PATTERNS, flood
from benchmarks.questions.latency import ticking
from benchmarks.questions.processes import run_nodes
from benchmarks.questions.timers import ticked
from benchmarks.receiver import Stopwatch
from busflow.runner.loops.choice import chosen_loop

TURN = "a turn"
ALONE = "1 → 1, one at a time"
HANDED_ON = "timer → handler"
TICKS = "1 kHz timer"
SIZE = "320 B"
DELIVERIES = {
    "1 → 1": ("1 → 1", "def"),
    "1 → 1, async": ("1 → 1", "async def"),
    "1 → 10": ("1 → 10", "def"),
    ALONE: ("1 → 1", "def"),
}


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """One case on one event loop."""
    if case == SIZE:
        return _between(contender.way, effort)
    new_loop = asyncio.new_event_loop if contender.way == "asyncio" else chosen_loop(contender.way)
    with asyncio.Runner(loop_factory=new_loop) as runner:
        return runner.run(_within(case, effort))


async def _within(case: str, effort: Effort) -> Sample:
    if case == TURN:
        return {"s": await _turn_s(effort)}
    if case == HANDED_ON:
        return {"p50 s": median(await ticking(Stopwatch(), "def", 20 if effort.is_quick else 150)) / 1e9}
    if case == TICKS:
        return await _exactness(100 if effort.is_quick else 1000)
    pattern, kind = DELIVERIES[case]
    way: InProcess = BUSFLOW.way
    return {"s": await flood(replace(way, burst=1) if case == ALONE else way, PATTERNS[pattern], kind, effort)}


async def _turn_s(effort: Effort) -> float:
    """The CPU time of a turn of the loop, in which one task has its own."""
    until, began_ns, turns = time.perf_counter() + effort.sample_s, time.process_time_ns(), 0
    while not turns or time.perf_counter() < until:  # one round at least, also where the processor was away that long
        for _ in range(100):
            await asyncio.sleep(0)
        turns += 100
    return (time.process_time_ns() - began_ns) / turns / 1e9


async def _exactness(ticks: int) -> Sample:
    """How far from its moment a tick is, early or late, and how many come early or not at all."""
    node = await ticked(0.001, ticks)
    off_ns = [abs(late_ns) for late_ns in node.late_ns]
    fired, missed = node.timer.fired, node.timer.missed
    return {
        "p50 s": median(off_ns) / 1e9,
        "p99 s": quantiles(off_ns, n=100, method="inclusive")[98] / 1e9,
        "early %": 100 * sum(late_ns < 0 for late_ns in node.late_ns) / fired,
        "missed %": 100 * missed / (fired + missed),
    }


def _between(loop: str, effort: Effort) -> Sample:
    """From a node into a node of another process of the run."""
    seconds = 0.1 if effort.is_quick else 0.4
    # The path of a socket must be short, which not every system's own folder for such files lets it be.
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder:
        found = run_nodes(Path(folder), "block", SIZES[SIZE], seconds, "--event-loop", loop)
    return {name: found[name] for name in ("p50 s", "rate /s", "CPU s")}


COST = "CPU time of the process"
IDLE = "Wall time, everything idle"
ACROSS = "Between two processes, 320 B"
CASES = [
    *(Case(name, COST) for name in (TURN, *DELIVERIES)),
    Case(HANDED_ON, IDLE),
    Case(TICKS, IDLE),
    Case(SIZE, ACROSS, ""),
]

QUESTION = Question(
    name="loops",
    title="Event loops",
    explanation=(
        "busflow on its own event loop, on uvloop's and on asyncio's as it comes. A publish: 64 of them before the "
        "loop has its turn, or one at a time from a task. From a timer's publish to the handler's first line. A node's "
        "timer at 1 kHz: how far from its moment a tick is, how many come too early, and how many are missed since the "
        "next one is due. Between two processes as below; a sender that waits for room does so for 0.1 ms, on uvloop "
        "for a turn."
    ),
    cases=CASES,
    contenders=[
        Contender("busflow", "busflow", note="its own loop"),
        Contender("uvloop", "uvloop", needs=("uvloop",)),
        Contender("asyncio", "asyncio", cases=frozenset(case.name for case in CASES[:-1])),
    ],
    measure=measure,
)
