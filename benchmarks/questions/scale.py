"""Scale: whether a delivery costs more where there are many topics, nodes or messages; and the memory they take."""

from __future__ import annotations

import asyncio
import gc
import time
import tracemalloc
from collections.abc import Sequence
from dataclasses import replace

from benchmarks.peers import Way, graph
from benchmarks.peers.graph import message
from benchmarks.peers.roster import ALL, BUSFLOW, InProcess
from benchmarks.question import Case, Contender, Effort, Question, Sample
from benchmarks.questions.delivery import PATIENCE_S
from benchmarks.receiver import Receiver, received

COUNTS = (1, 10, 100, 1000)
DEPTHS = (1, 10, 100, 1000)
ROUND_ROBIN = 64


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """The CPU time of a publish and its delivery, or the bytes that one more of something takes."""
    number, _, what = case.partition(" ")
    way: InProcess = contender.way
    if number == "bytes":
        return {"B": _bytes_each(contender, what, effort)}
    if what == "idle":
        return {"s": asyncio.run(_cost_s(way.way, min(int(number), effort.sizes), ROUND_ROBIN, effort, used=1))}
    if what == "waiting":
        return {"s": asyncio.run(_cost_s(way.way, 1, int(number), effort))}
    chosen = graph.two_nodes if contender.name == "busflow" and what == "topics" else way.way
    return {"s": asyncio.run(_cost_s(chosen, min(int(number), effort.sizes), ROUND_ROBIN, effort))}


async def _cost_s(way: Way, topics: int, burst: int, effort: Effort, used: int | None = None) -> float:
    """Publish on each topic that is used in turn, so many messages before the loop has its turn."""
    names = [f"t{number}" for number in range(topics)]
    receivers = [Receiver() for _ in names]
    async with way(names, [(name, each.take) for name, each in zip(names, receivers, strict=True)]) as publishers:
        turns = [publishers[number % (used or topics)] for number in range(max(burst, topics) // burst * burst)]
        bursts = [turns[at : at + burst] for at in range(0, len(turns), burst)]
        content, expected = message(), 0
        for publish in publishers:  # what is made at the first message is made before the clock runs
            publish(content)
            expected += 1
            await _delivered(receivers, expected)
        began_s, began_ns, count = time.perf_counter(), time.process_time_ns(), 0
        while not count or time.perf_counter() - began_s < effort.sample_s:
            for chosen in bursts:
                for publish in chosen:
                    publish(content)
                await asyncio.sleep(0)
            count += len(turns)
            await _delivered(receivers, expected + count)
        return (time.process_time_ns() - began_ns) / 1e9 / count


async def _delivered(receivers: Sequence[Receiver], expected: int) -> None:
    until = time.perf_counter() + PATIENCE_S
    while (got := received(receivers)) < expected:
        await asyncio.sleep(0)
        if time.perf_counter() > until:
            raise RuntimeError(f"{got} of {expected} messages were delivered")


def _bytes_each(contender: Contender, what: str, effort: Effort) -> float:
    """What Python allocates for one more topic with its two ends, subscription, or node."""
    few, many = 10, max(20, effort.sizes // 4)
    asyncio.run(_bytes(contender, what, few))  # what is made once is made now
    tracemalloc.start()
    try:
        return (asyncio.run(_bytes(contender, what, many)) - asyncio.run(_bytes(contender, what, few))) / (many - few)
    finally:
        tracemalloc.stop()


async def _bytes(contender: Contender, what: str, count: int) -> int:
    way: InProcess = contender.way
    chosen: Way = way.way if what == "a node" else graph.two_nodes if contender.name == "busflow" else way.way
    names = ["t"] if what == "a subscription" else [f"t{number}" for number in range(count)]
    ends = ["t"] * count if what == "a subscription" else names
    receivers = [Receiver() for _ in ends]
    gc.collect()
    before = tracemalloc.get_traced_memory()[0] if tracemalloc.is_tracing() else 0
    async with chosen(names, [(name, each.take) for name, each in zip(ends, receivers, strict=True)]):
        gc.collect()
        return (tracemalloc.get_traced_memory()[0] if tracemalloc.is_tracing() else 0) - before


IDLE = [
    Case(f"{count} idle", "A publish and its delivery, on one of so many topics, each with two nodes", f"{count:,}")
    for count in COUNTS
]
TOPICS = [
    Case(f"{count} topics", "The same on each of so many topics in turn, all in two nodes", f"{count:,}")
    for count in COUNTS
]
NODES = [
    Case(f"{count} nodes", "The same on each of so many topics in turn, each with two nodes of its own", f"{count:,}")
    for count in COUNTS
]
DEEP = [
    Case(f"{depth} waiting", "A publish and its delivery, so many of one topic at a time", f"{depth:,}")
    for depth in DEPTHS
]
BYTES = [
    Case(f"bytes {what}", "Memory that one more takes", what)
    for what in ("a topic with its ends", "a subscription", "a node")
]
ALONE = frozenset(case.name for case in (*NODES, BYTES[2]))
"""What only busflow knows: the others have no nodes."""


def _takes_part(contender: Contender) -> bool:
    way: InProcess = contender.way
    return "def" in way.kinds and not way.awaits and not way.threads


QUESTION = Question(
    name="scale",
    title="Many topics, many nodes, deep queues",
    explanation=(
        "CPU time of the process for a publish and its delivery, 64 of them before the loop has its turn. What else "
        "there is must not make it dearer. Where each message is of another topic than the one before, no two are "
        "delivered in one go, and little of what they need is still in the processor's cache. Memory is what Python "
        "allocates for 250 of them less that for 10, divided."
    ),
    cases=[*IDLE, *TOPICS, *NODES, *DEEP, *BYTES],
    contenders=[
        replace(
            each,
            cases=None if each is BUSFLOW else frozenset(case.name for case in (*IDLE, *TOPICS, *DEEP, *BYTES[:2])),
        )
        for each in ALL
        if _takes_part(each)
    ],
    measure=measure,
    quick=frozenset(case.name for case in (IDLE[1], TOPICS[1], NODES[1], DEEP[1], *BYTES)),
)
