"""Collection: the longest pause that Python's garbage collector makes, where many objects live."""

from __future__ import annotations

import asyncio
import gc
import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import busflow
from benchmarks.question import Case, Contender, Effort, Question, Sample
from busflow import Node

CASE = "600,000 objects"
PERIOD_S = 0.005


class Pauses:
    """Objects that live, others that come and go, and the pauses that come of them."""

    def __init__(self, effort: Effort) -> None:
        self.objects = 600 * effort.sizes
        self.until_s = 0.2 if effort.is_quick else 2.0
        self.longest_ns = self.total_ns = 0
        self._began_ns = 0
        self._living: list[Any] = []
        self._going: list[Any] = []

    def fill(self) -> None:
        """Make what lives: lists in a list, as parsed maps or models have them."""
        self._living = [[number] for number in range(self.objects)]

    def churn(self) -> None:
        """Make what dies soon, some of it in circles that only the collector ends."""
        for _ in range(200):
            circle: list[Any] = []
            circle.append(circle)
            self._going.append((circle, {}))
        if len(self._going) > 5000:
            self._going.clear()

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Measure every pause meanwhile."""
        gc.callbacks.append(self._hear)
        try:
            yield
        finally:
            gc.callbacks.remove(self._hear)

    def _hear(self, phase: str, _info: object) -> None:
        if phase == "start":
            self._began_ns = time.perf_counter_ns()
        else:
            took = time.perf_counter_ns() - self._began_ns
            self.longest_ns, self.total_ns = max(self.longest_ns, took), self.total_ns + took

    def sample(self) -> Sample:
        return {"longest pause s": self.longest_ns / 1e9, "all pauses %": self.total_ns / 1e9 / self.until_s * 100}


class Hoarder(Node):
    """Lives with many objects."""

    pauses: Pauses

    def declare(self) -> None:
        self.create_timer(PERIOD_S, self.tick)

    async def start(self) -> None:
        self.pauses.fill()

    async def run(self) -> None:
        await self.clock.sleep(0.1)  # whatever busflow does about it, it has done by now
        with self.pauses.watched():
            await self.clock.sleep(self.pauses.until_s)
        os.kill(os.getpid(), signal.SIGINT)

    def tick(self) -> None:
        self.pauses.churn()


def in_busflow(pauses: Pauses) -> None:
    """A node of `busflow.run`, whose objects are made when it starts."""
    node = Hoarder(name="hoarder")
    node.pauses = pauses
    busflow.run(node, inspect=False)


def in_asyncio(pauses: Pauses) -> None:
    """A task, with Python as it comes."""

    async def main() -> None:
        pauses.fill()
        end = time.perf_counter() + pauses.until_s
        with pauses.watched():
            while time.perf_counter() < end:
                pauses.churn()
                await asyncio.sleep(PERIOD_S)

    asyncio.run(main())


def measure(contender: Contender, _case: str, effort: Effort) -> Sample:
    """How long the collector stopped everything, at worst and in all."""
    pauses = Pauses(effort)
    run: Callable[[Pauses], None] = contender.way
    thresholds = gc.get_threshold()
    try:
        run(pauses)
    finally:
        gc.unfreeze()
        gc.set_threshold(*thresholds)
    return pauses.sample()


QUESTION = Question(
    name="collection",
    title="Garbage collection",
    explanation=(
        "600,000 lists live, made when the node starts; 80,000 objects a second come and go, half of them in circles. "
        "Wall time in which the collector lets nothing else run."
    ),
    cases=[Case(CASE, "600,000 objects live", "")],
    contenders=[Contender("busflow", in_busflow), Contender("asyncio", in_asyncio, note="Python as it comes")],
    measure=measure,
)
