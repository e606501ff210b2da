"""Latency: how soon a handler of the same process is entered when nothing else is going on."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from dataclasses import replace
from statistics import median, quantiles
from typing import Any

import busflow
from benchmarks.peers import Publish
from benchmarks.peers.graph import Source, message, sink
from benchmarks.peers.roster import ALL, InProcess
from benchmarks.question import Case, Contender, Effort, Question, Quoted, Sample
from benchmarks.receiver import Stopwatch
from busflow.runner.loops.system import new_event_loop

PAUSE_S = 0.002
"""Between two messages: long enough for everything to have gone to sleep."""
TIMED = "from a timer, def"
TURN = "a turn of the loop"


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """Wall time from just before publishing to the handler's first line."""
    where, _, kind = case.rpartition(", ")
    count = 20 if effort.is_quick else 150
    with asyncio.Runner(loop_factory=new_event_loop) as runner:  # the loop of `busflow run`, for everybody
        late_ns = runner.run(_late(contender, where, kind, count))
    return {"p50 s": median(late_ns) / 1e9, "p99 s": quantiles(late_ns, n=100)[98] / 1e9}


async def _late(contender: Contender, where: str, kind: str, count: int) -> list[int]:
    if contender.name == TURN:
        return [await _turn_ns() for _ in range(count)]
    way: InProcess = contender.way
    watch = Stopwatch()
    if where == "from a timer" and contender.name == "busflow":
        return await ticking(watch, kind, count)
    async with way.way(["t"], [("t", watch.handler(kind))]) as (publish,):
        if where == "from a timer":
            sent = await _from_timer(publish, count)
        else:
            sent = await _from_task(publish, count, awaits=way.awaits)
        await asyncio.sleep(0.05)
    return _differences(sent, watch.arrived_ns)


def _differences(sent: Sequence[int], arrived: Sequence[int]) -> list[int]:
    if len(sent) != len(arrived):
        raise RuntimeError(f"{len(arrived)} of {len(sent)} messages were delivered")
    return [there - here for here, there in zip(sent, arrived, strict=True)]


async def _turn_ns() -> int:
    await asyncio.sleep(PAUSE_S)
    began = time.perf_counter_ns()
    await asyncio.sleep(0)
    return time.perf_counter_ns() - began


async def _from_task(publish: Publish, count: int, *, awaits: bool) -> list[int]:
    sent: list[int] = []
    content = message()
    for _ in range(count):
        await asyncio.sleep(PAUSE_S)
        sent.append(time.perf_counter_ns())
        if awaits:
            await publish(content)
        else:
            publish(content)
    return sent


async def _from_timer(publish: Publish, count: int) -> list[int]:
    """Publish from a callback of the loop's own timer."""
    sent: list[int] = []
    loop, content, over = asyncio.get_running_loop(), message(), asyncio.Event()

    def tick() -> None:
        sent.append(time.perf_counter_ns())
        publish(content)
        if len(sent) < count:
            loop.call_later(PAUSE_S, tick)
        else:
            over.set()

    loop.call_later(PAUSE_S, tick)
    await over.wait()
    return sent


async def ticking(watch: Stopwatch, kind: str, count: int) -> list[int]:
    """Publish from a timer of a node."""
    ticker = Ticker(name="ticker")
    ticker.topics = ["t"]
    ticker.sent, ticker.left, ticker.over = [], count, asyncio.Event()
    async with busflow.launch(ticker, sink("sink", [("t", watch.handler(kind))])):
        await ticker.over.wait()
        await asyncio.sleep(0.02)
    return _differences(ticker.sent, watch.arrived_ns)


class Ticker(Source):
    """Publishes on a timer, and notes when."""

    sent: list[int]
    left: int
    over: asyncio.Event

    def declare(self) -> None:
        super().declare()
        self.content: Any = message()
        self.create_timer(PAUSE_S, self.tick)

    def tick(self) -> None:
        if self.left:
            self.left -= 1
            self.sent.append(time.perf_counter_ns())
            self.outs[0].publish(self.content)
        else:
            self.over.set()


CASES = [
    Case(f"{where}, {kind}", f"To `{kind}` handlers", where)
    for kind in ("def", "async def")
    for where in ("from a timer", "from a task")
]


def _cases(contender: Contender) -> frozenset[str]:
    way: InProcess = contender.way
    where = ["from a task"] if way.awaits else ["from a timer", "from a task"]
    return frozenset(f"{each}, {kind}" for each in where for kind in way.kinds)


QUESTION = Question(
    name="latency",
    title="Latency within a process, everything idle",
    explanation=(
        "One message every 2 ms; wall time from just before publishing to the first line of the handler. From a timer: "
        "a node's @timer, elsewhere the loop's call_later."
    ),
    cases=CASES,
    contenders=[
        *(replace(each, cases=_cases(each)) for each in ALL),
        Contender(TURN, cases=frozenset({"from a task, def"}), note="for comparison"),
    ],
    measure=measure,
    quoted=(
        Quoted("rclpy, SingleThreadedExecutor", {(TIMED, "p50 s"): 142e-6, (TIMED, "p99 s"): 334e-6}),
        Quoted("rclpy, EventsExecutor", {(TIMED, "p50 s"): 41e-6, (TIMED, "p99 s"): 115e-6}),
    ),
    quoted_from="rclpy, at 1 kHz with Float64: see above for where its figures are from.",
)  # fmt: skip
