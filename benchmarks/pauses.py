"""How long Python's cyclic collector holds up a graph with 600,000 objects, as it is and as a run sets it.

Run it with `python benchmarks/pauses.py`. Each way has a process of its own, makes the objects, and then for two
seconds others that go again, one in ten of them in a cycle. A pause is CPU time of this thread. Nothing is asserted.
"""

import gc
import subprocess
import sys
import time
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from busflow.runner.garbage import StepwiseCollection

QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
LIVE, SECONDS = (6_000, 0.05) if QUICK else (600_000, 2.0)
KEPT = 2_000
"""How many of the last that were made are still needed."""


def longest_pause_s(*, settled: bool) -> float:
    """The longest pause, in this process, of a collector that has been told that the graph has started, or not."""
    live = [([number], {"number": number}) for number in range(LIVE // 3)]
    pauses: list[float] = []

    def hear(phase: str, _info: dict[str, int]) -> None:
        pauses.append(time.thread_time() if phase == "start" else time.thread_time() - pauses.pop())

    with ExitStack() as stack:
        if settled:
            stack.enter_context(closing(StepwiseCollection())).begin()
        gc.callbacks.append(hear)
        stack.callback(gc.callbacks.remove, hear)
        _churn()
        if not settled:
            gc.collect()  # what Python does by itself sooner or later, and later than in two seconds
    del live
    return max(pauses, default=0.0)


def _churn() -> None:
    kept: list[Any] = [None] * KEPT
    end, number = time.thread_time() + SECONDS, 0
    while time.thread_time() < end:
        for _ in range(1_000):
            number += 1
            made: list[Any] = [number]
            if number % 10 == 0:
                made.append(made)
            kept[number % KEPT] = (made, {"made": made})


def figures() -> dict[str, float]:
    """The longest pauses in seconds, by way."""
    return {"as Python is": longest_of("plain"), "as a run sets it": longest_of("settled")}


def longest_of(way: str) -> float:
    """The longest pause in seconds, in a process of its own."""
    command = [sys.executable, __file__, way, *sys.argv[1:]]
    return float(subprocess.run(command, check=True, capture_output=True).stdout)  # noqa: S603  # this file


def main() -> None:
    if set(sys.argv[1:]) - {"--quick"}:
        print(longest_pause_s(settled=sys.argv[1] == "settled"))
        return
    for name, pause_s in figures().items():
        print(f"{name:52} {pause_s * 1e3:8.1f} ms")


if __name__ == "__main__":
    main()
