"""Conductor: what a sender sends, whatever the way: some at a steady rate, then as many as arrive."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from statistics import median, quantiles
from typing import Any

from benchmarks.crossing import RATES_HZ, RING, WINDOWS
from benchmarks.crossing.board import Board

PATIENCE_S = 20.0
STILL_S = 1.0
"""When nothing more has arrived for so long, the rest is lost."""
LOST_S = 0.05
"""The same while others wait."""
BATCH = 32

Publish = Callable[[Any], Any]


class Conductor:
    """Sends over one way, and reads from the board what became of it."""

    def __init__(
        self, board: Board, publish: Publish, messages: Sequence[Any], flood: Any, hello: Any, *, awaits: bool = False
    ) -> None:
        """`awaits` says whether publishing is to be awaited."""
        self._board, self._publish, self._awaits = board, publish, awaits
        self._messages, self._flood, self._hello = messages, flood, hello

    async def _put(self, message: Any) -> None:
        if self._awaits:
            await self._publish(message)
        else:
            self._publish(message)

    async def run(self, size: int, seconds: float) -> dict[str, float]:
        """All of it; the figures."""
        await self._greet()
        late_s = await self._latencies(RATES_HZ[size], max(20, int(RATES_HZ[size] * seconds)))
        rate, cpu_s, lost = await self._rate(WINDOWS[size], seconds)
        found = {"p50 s": median(late_s), "p99 s": quantiles(late_s, n=100)[98], "rate /s": rate, "CPU s": cpu_s}
        return found | ({"lost %": lost} if lost else {})

    async def _greet(self) -> None:
        until, sent = time.perf_counter() + PATIENCE_S, 0
        while not self._board.greeted:
            if time.perf_counter() > until:
                raise RuntimeError(f"nothing has arrived within {PATIENCE_S:g} s")
            await self._put(self._hello)
            sent += 1
            await asyncio.sleep(0.02)
        await self._arrived(lambda: self._board.greeted, sent)  # some ways have no place for what is not taken out
        await asyncio.sleep(0.1)

    async def _latencies(self, rate_hz: float, count: int) -> list[float]:
        sent: list[int] = []
        began = time.perf_counter()
        for number in range(count):
            message = self._messages[number % RING]
            sent.append(time.perf_counter_ns())
            await self._put(message)
            await asyncio.sleep(max(0.0, began + (number + 1) / rate_hz - time.perf_counter()))
        await self._arrived(lambda: len(self._board.paced), count)
        arrived = self._board.paced[:count]
        if len(arrived) < count:
            arrived = _aligned(arrived)
        late = [(there - sent[at]) / 1e9 for at, (there, _) in enumerate(arrived)]
        if not late:
            raise RuntimeError("nothing has arrived in time")
        return late

    async def _rate(self, window: int, seconds: float) -> tuple[float, float, float]:
        """Messages a second that arrive, the CPU time of both processes for each, and the percentage that is lost."""
        board, message, sent = self._board, self._flood, 0
        began, began_cpu_s = time.perf_counter(), board.cpu_s()
        batch = min(BATCH, max(1, window // 4))
        given_up, seen, since = 0, 0, began
        while (now := time.perf_counter()) - began < seconds:
            there = board.flooded
            if there != seen:
                seen, since = there, now
            if sent - there - given_up > window - batch:
                if now - since > LOST_S:  # what has not come by now is lost, and makes room for others
                    given_up = sent - there
                await asyncio.sleep(0.0001)
                continue
            if self._awaits:
                for _ in range(batch):
                    await self._publish(message)
            else:
                for _ in range(batch):
                    self._publish(message)
            sent += batch
            await asyncio.sleep(0)
        reached = board.flooded / (time.perf_counter() - began)
        cpu_s = (board.cpu_s() - began_cpu_s) / max(1, board.flooded)
        await self._arrived(lambda: board.flooded, sent)
        return reached, cpu_s, 100 * (sent - board.flooded) / sent

    async def _arrived(self, count: Callable[[], int], expected: int) -> None:
        """Wait until all are there, or no more come."""
        seen, since = count(), time.perf_counter()
        while seen < expected and time.perf_counter() - since < STILL_S:
            await asyncio.sleep(0.005)
            if (now := count()) != seen:
                seen, since = now, time.perf_counter()


def _aligned(arrived: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """What arrived before the first that is missing: from there on, who is who is not known."""
    for at, ((_, before), (_, after)) in enumerate(pairwise(arrived), start=1):
        if after != (before + 1) % RING:
            return arrived[:at]
    return arrived
