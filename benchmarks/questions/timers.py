"""Timers: how late they are, while nothing else happens and while a topic floods itself."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from statistics import median, quantiles
from typing import Any

import busflow
from benchmarks.peers.graph import Source, message, sink
from benchmarks.question import Case, Contender, Effort, Question, Sample
from busflow.runner.loops.system import new_event_loop

RATES_HZ = (10, 100, 1000)
LoopFactory = Callable[[], asyncio.AbstractEventLoop]


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """How long after its moment on the grid a tick's handler is entered."""
    rate, _, flooded = case.partition(" Hz")
    period_s = 1 / int(rate)
    seconds = 0.15 if effort.is_quick else max(0.5, 6 * period_s)
    ticks = max(2, int(seconds / period_s))
    run: Any = contender.way
    late_ns = run(period_s, ticks, flood=bool(flooded))
    return {"p50 s": median(late_ns) / 1e9, "p99 s": quantiles(late_ns, n=100, method="inclusive")[98] / 1e9}


class Clockwork(Source):
    """A timer, and how late its ticks were: less than nothing where one was early."""

    period_s: float
    late_ns: list[int]
    left: int
    over: asyncio.Event

    def declare(self) -> None:
        super().declare()
        self.timer = self.create_timer(self.period_s, self.tick)

    def tick(self) -> None:
        due_ns = self.timer._due_ns(self.timer._tick - 1)  # noqa: SLF001  # the grid, which nobody else tells
        self.late_ns.append(time.monotonic_ns() - due_ns)
        self.left -= 1
        if not self.left:
            self.over.set()


async def ticked(period_s: float, ticks: int, *, flood: bool = False) -> Clockwork:
    """A node whose timer has ticked so often; a handler that publishes to its own topic is the flood."""
    node = Clockwork(name="clockwork")
    node.topics, node.period_s, node.late_ns, node.left, node.over = ["t"], period_s, [], ticks, asyncio.Event()
    content = message()

    def again(_message: object) -> None:
        node.outs[0].publish(content)

    async with busflow.launch(node, sink("sink", [("t", again)])):
        if flood:
            again(None)
        await node.over.wait()
    return node


def busflow_timer(period_s: float, ticks: int, *, flood: bool) -> list[int]:
    """A node's timer, on the loop of `busflow run`."""
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        return runner.run(ticked(period_s, ticks, flood=flood)).late_ns


def asyncio_timer(loop_factory: LoopFactory) -> Callable[..., list[int]]:
    """A loop's own `call_at` on a grid; callbacks that call themselves again are the flood."""

    def run(period_s: float, ticks: int, *, flood: bool) -> list[int]:
        async def main() -> list[int]:
            loop, late_ns, over = asyncio.get_running_loop(), list[int](), asyncio.Event()
            start, start_ns, period_ns = loop.time(), time.monotonic_ns(), round(period_s * 1e9)
            aim = 1

            def tick() -> None:
                nonlocal aim
                passed_ns = time.monotonic_ns() - start_ns
                late_ns.append(abs(passed_ns - aim * period_ns))  # uvloop's may be early
                if len(late_ns) == ticks:
                    over.set()
                    return
                aim = max(aim, passed_ns // period_ns) + 1
                loop.call_at(start + aim * period_s, tick)

            def again() -> None:
                if not over.is_set():
                    loop.call_soon(again)

            loop.call_at(start + period_s, tick)
            if flood:
                again()
            await over.wait()
            return late_ns

        with asyncio.Runner(loop_factory=loop_factory) as runner:
            return runner.run(main())

    return run


def uvloop_timer(period_s: float, ticks: int, *, flood: bool) -> list[int]:
    """The same on uvloop."""
    import uvloop

    return asyncio_timer(uvloop.new_event_loop)(period_s, ticks, flood=flood)


CASES = [
    *(Case(f"{rate} Hz", "How late a tick is, everything idle") for rate in RATES_HZ),
    *(
        Case(f"{rate} Hz, flooded", "How late a tick is, while a handler feeds itself", f"{rate} Hz")
        for rate in RATES_HZ
    ),
]

QUESTION = Question(
    name="timers",
    title="Timers",
    explanation=(
        "Wall time from a tick's moment on the grid to its handler; a tick later than a period counts from the last "
        "moment, one that is early (uvloop's) by how much. Flooded: a handler publishes to its own topic for ever; in "
        "asyncio a callback calls itself soon."
    ),
    cases=CASES,
    contenders=[
        Contender("busflow", busflow_timer),
        Contender("asyncio call_at", asyncio_timer(asyncio.new_event_loop)),
        Contender("uvloop call_at", uvloop_timer, needs=("uvloop",)),
    ],
    measure=measure,
)
