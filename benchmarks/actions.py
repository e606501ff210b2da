"""A goal that ends at once beside a service call, in one process: `python benchmarks/actions.py` prints their ratio.

Both are timed in turn, in processor time, so that a busy machine changes little; the median of the rounds counts.
"""

from __future__ import annotations

import asyncio
import statistics
import sys
import time

import busflow
from busflow import ActionType, Message, Node, RunningGoal, action, action_client, client, service
from busflow.msgs.std_srvs import Trigger

QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
ROUNDS, TIMES = (1, 20) if QUICK else (7, 500)


class Wave(ActionType, package="benchmarks"):
    """Waves."""

    class Goal(Message):
        """Nothing."""

    class Result(Message):
        """Nothing."""

    class Feedback(Message):
        """Nothing."""


class Answering(Node):
    """Answers goals and requests at once."""

    @action(Wave, "~/wave")
    async def wave(self, _goal: RunningGoal[Wave]) -> Wave.Result:
        return Wave.Result()

    @service(Trigger, "~/trigger")
    async def trigger(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response()


class Asking(Node):
    """Sends both."""

    wave = action_client(Wave, "answering/wave")
    trigger = client(Trigger, "answering/trigger")


async def main() -> None:
    """Print the medians."""
    goals, calls = [], []
    async with busflow.launch(Answering, Asking) as graph:
        asking = graph.node(Asking)
        for _ in range(ROUNDS):
            began = time.process_time()
            for _ in range(TIMES):
                await asking.trigger.call()
            middle = time.process_time()
            for _ in range(TIMES):
                await asking.wave.run(Wave.Goal())
            calls.append((middle - began) / TIMES)
            goals.append((time.process_time() - middle) / TIMES)
    goal, call = statistics.median(goals), statistics.median(calls)
    print(f"call {call * 1e6:.0f} µs, goal {goal * 1e6:.0f} µs, ratio {goal / call:.1f}")


if __name__ == "__main__":
    asyncio.run(main())
