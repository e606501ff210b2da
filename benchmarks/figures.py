"""Figures: what several ways of doing the same cost, measured in turns, each beside a bare call.

Other programs slow this one down, and a processor has slow and fast gears. So the contenders take turns, round by
round, each of few milliseconds; what a round costs is CPU time of this thread, and is compared with bare calls of a
Python function that are measured right before it. Of many rounds the median tells.
"""

import sys
import time
from collections.abc import Awaitable, Callable, Iterable
from dataclasses import dataclass
from statistics import median, quantiles

QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
ROUNDS = 2 if QUICK else 60  # one has no quartiles
_CALLS = 4_000
_ROUND_NS = 100_000 if QUICK else 3_000_000


@dataclass(frozen=True, slots=True)
class Contender:
    """One way of doing something, so many times in each call of `work`."""

    name: str
    work: Callable[[], Awaitable[object]]
    times: int


@dataclass(frozen=True, slots=True)
class Figure:
    """What it costs to do something once."""

    name: str
    ns: float
    """The least that a round told, in nanoseconds of CPU time."""
    calls: float
    """The median of what the rounds told, in bare calls of the same round."""
    spread: tuple[float, float]
    """The quartiles of the same."""

    def __str__(self) -> str:
        low, high = self.spread
        return f"{self.name:52} {self.ns:8,.0f} ns {self.calls:7.1f} calls  ({low:.1f} to {high:.1f})"


def nothing(_: object) -> None:
    """The function of a bare call."""


def bare_call() -> float:
    """Nanoseconds that a bare call takes now."""
    began = time.thread_time_ns()
    for _ in range(_CALLS):
        nothing(None)
    return (time.thread_time_ns() - began) / _CALLS


async def measure(contenders: Iterable[Contender], rounds: int = ROUNDS) -> list[Figure]:
    """What each of them costs, in the order given."""
    all_of_them = list(contenders)
    batches = {each.name: max(1, round(_ROUND_NS / await _warm(each))) for each in all_of_them}
    told: dict[str, list[tuple[float, float]]] = {each.name: [] for each in all_of_them}
    for _ in range(rounds):
        for each in all_of_them:
            call = bare_call()
            cost = await _once(each, batches[each.name]) / each.times
            told[each.name].append((cost, cost / call))
    return [_figure(name, costs) for name, costs in told.items()]


async def _warm(contender: Contender) -> float:
    """Nanoseconds that a call of `work` takes once Python has adapted itself to it."""
    return min([await _once(contender, 5) for _ in range(10)])


async def _once(contender: Contender, batches: int) -> float:
    work = contender.work
    began = time.thread_time_ns()
    for _ in range(batches):
        await work()
    return (time.thread_time_ns() - began) / batches


def _figure(name: str, costs: list[tuple[float, float]]) -> Figure:
    ratios = [ratio for _, ratio in costs]
    low, _, high = quantiles(ratios, n=4)
    return Figure(name, min(cost for cost, _ in costs), median(ratios), (low, high))
