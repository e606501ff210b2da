"""Roster: who takes part in what is measured within one process."""

from __future__ import annotations

from dataclasses import dataclass

from benchmarks.peers import Way, emitters, frameworks, graph, middleware, queues
from benchmarks.question import Contender

BURST = 64
"""Messages that are published before the event loop has its turn."""


@dataclass(frozen=True)
class InProcess:
    """How a contender is to be driven."""

    way: Way
    kinds: tuple[str, ...] = ("def", "async def")
    """Which handlers it can call."""
    awaits: bool = False
    """Whether publishing has to be awaited."""
    threads: bool = False
    """Whether it calls handlers in threads of its own, so that waiting for them must leave them the processor."""
    burst: int = BURST
    most: int = 100
    """The most handlers that it can be asked to have."""


BUSFLOW = Contender("busflow", InProcess(graph.many_nodes))
CALLS = Contender("bare calls", InProcess(queues.bare_calls, kinds=("def",)), note="no queue: the floor")
QUEUE = Contender("asyncio.Queue", InProcess(queues.asyncio_queues), note="and a task")
STREAM = Contender("anyio stream", InProcess(queues.anyio_streams), needs=("anyio",), note="and a task")

ALL = (
    BUSFLOW,
    CALLS,
    QUEUE,
    STREAM,
    Contender("reactivex", InProcess(emitters.subjects, kinds=("def",)), needs=("reactivex",), note="calls at once"),
    Contender(
        "reactivex, on the loop",
        InProcess(emitters.scheduled_subjects, kinds=("def",)),
        needs=("reactivex",),
    ),
    Contender("pyee", InProcess(emitters.pyee), needs=("pyee",), note="calls at once; async: a task each"),
    Contender("blinker", InProcess(emitters.blinker, kinds=("def",)), needs=("blinker",), note="calls at once"),
    Contender(
        "aiopubsub", InProcess(emitters.aiopubsub), needs=("aiopubsub",), note="calls at once; async: a task each"
    ),
    Contender("ezmsg", InProcess(frameworks.ezmsg, awaits=True, burst=16), needs=("ezmsg",)),
    Contender(
        "FastStream, test broker",
        InProcess(frameworks.faststream, awaits=True, burst=4),
        needs=("faststream", "nats"),
        note="encodes and decodes",
    ),
    Contender(
        "bubus",
        InProcess(frameworks.bubus, awaits=True, burst=4, most=10),
        needs=("bubus",),
        note="makes an event each",
    ),
    Contender(
        "Zenoh, one session",
        InProcess(middleware.zenoh, kinds=("def",), threads=True),
        needs=("zenoh",),
        note="bytes, in threads",
    ),
    Contender(
        "cyclonedds",
        InProcess(middleware.cyclonedds, kinds=("def",), threads=True),
        needs=("cyclonedds",),
        note="bytes, in threads",
    ),
)
