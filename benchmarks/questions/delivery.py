"""Delivery: what it costs to hand a message from a publisher to handlers of the same process."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

from benchmarks.peers import Publish
from benchmarks.peers.graph import message
from benchmarks.peers.roster import ALL, InProcess
from benchmarks.question import Case, Contender, Effort, Question, Quoted, Sample
from benchmarks.receiver import AwaitingRelay, Receiver, Relay, received

PATIENCE_S = 20.0


@dataclass(frozen=True)
class Pattern:
    """Who publishes to whom."""

    publishers: int = 1
    handlers: int = 1
    links: int = 1
    """How many topics a message goes through, each handler publishing to the next."""

    def wiring(self, kind: str, *, awaits: bool) -> tuple[list[str], list[str], list[Receiver]]:
        """The topics of all publishers, the topic of each receiver, the receivers."""
        if self.links == 1:
            return ["t"] * self.publishers, ["t"] * self.handlers, [Receiver() for _ in range(self.handlers)]
        topics = [f"t{number}" for number in range(self.links)]
        relay = AwaitingRelay if awaits and kind == "async def" else Relay
        return topics, topics, [*(relay() for _ in topics[1:]), Receiver()]

    @property
    def deliveries(self) -> int:
        """How many handlers are called for one message that is published from outside."""
        return self.handlers * self.links


PATTERNS = {
    "1 → 1": Pattern(),
    "1 → 10": Pattern(handlers=10),
    "1 → 100": Pattern(handlers=100),
    "10 → 1": Pattern(publishers=10),
    "chain of 5, a hop": Pattern(links=5),
}


def measure(contender: Contender, case: str, effort: Effort) -> Sample:
    """The CPU time of the process for one publish, or for one hop of the chain."""
    title, _, kind = case.rpartition(", ")
    way: InProcess = contender.way
    pattern = PATTERNS[title]
    cost_s = asyncio.run(flood(way, pattern, kind, effort))
    return {"s": cost_s / pattern.links}


async def flood(way: InProcess, pattern: Pattern, kind: str, effort: Effort) -> float:
    """Publish in bursts for a while, each delivered before the next; what one message cost.

    Raises:
        RuntimeError: not everything was delivered.
    """
    sources, ends, receivers = pattern.wiring(kind, awaits=way.awaits)
    handlers = [(topic, receiver.handler(kind)) for topic, receiver in zip(ends, receivers, strict=True)]
    async with way.way(sources, handlers) as publishers:
        for receiver, publish in zip(receivers, publishers[1:], strict=False):
            if isinstance(receiver, Relay):
                receiver.forward = publish
        used = publishers if pattern.links == 1 else publishers[:1]
        burst = Burst(way, used, receivers, pattern.deliveries)
        await burst.run()  # what is made at the first message is made before the clock runs
        return await burst.cost_s(effort.sample_s)


class Burst:
    """Publishes so many messages, and waits until all are delivered."""

    def __init__(
        self, way: InProcess, publishers: Sequence[Publish], receivers: Sequence[Receiver], deliveries: int
    ) -> None:
        self.size = max(1, way.burst // len(publishers))
        self._way, self._publishers, self._receivers = way, publishers, receivers
        self._each = self.size * len(publishers) * deliveries
        self._expected = 0
        self._message = message()

    @property
    def messages(self) -> int:
        return self.size * len(self._publishers)

    async def run(self) -> None:
        message, size = self._message, self.size
        if self._way.awaits:
            for publish in self._publishers:
                for _ in range(size):
                    await publish(message)
        else:
            for publish in self._publishers:
                for _ in range(size):
                    publish(message)
        self._expected += self._each
        await self._delivered()

    async def _delivered(self) -> None:
        await asyncio.sleep(0)
        until = time.perf_counter() + PATIENCE_S
        while (got := received(self._receivers)) < self._expected:
            await asyncio.sleep(0.0002 if self._way.threads else 0)
            if time.perf_counter() > until:
                raise RuntimeError(f"{got} of {self._expected} messages were delivered")

    async def cost_s(self, for_s: float) -> float:
        """The CPU time of the process for each message, over about so many seconds."""
        began_s, began_ns, bursts = time.perf_counter(), time.process_time_ns(), 0
        while not bursts or time.perf_counter() - began_s < for_s:
            await self.run()
            bursts += 1
        return (time.process_time_ns() - began_ns) / 1e9 / bursts / self.messages


def contenders() -> list[Contender]:
    """Everybody, each with the cases that it can do."""
    return [
        replace(each, cases=frozenset(case.name for case in CASES if _can(each, *case.name.rsplit(", ", 1))))
        for each in ALL
    ]


def _can(contender: Contender, title: str, kind: str) -> bool:
    """Whether it can; a `def` handler of those whose publishing is awaited cannot publish."""
    way: InProcess = contender.way
    pattern = PATTERNS[title]
    unable = way.awaits and kind == "def" and pattern.links > 1
    return kind in way.kinds and pattern.handlers <= way.most and not unable


CASES = [
    Case(f"{title}, {kind}", f"A publish to `{kind}` handlers", title)
    for kind in ("def", "async def")
    for title in PATTERNS
]

QUESTION = Question(
    name="delivery",
    title="Delivery within a process",
    explanation=(
        "64 messages are published (4 or 16 where a peer takes no more), then the event loop turns until all are "
        "delivered; each handler counts. CPU time of the process for one publish, in whatever thread; of the chain, "
        "for one hop."
    ),
    cases=CASES,
    contenders=contenders(),
    measure=measure,
    quoted=(
        Quoted("rclpy, SingleThreadedExecutor", {("1 → 1, def", "s"): 148.8e-6, ("1 → 10, def", "s"): 368e-6}),
        Quoted("rclpy, EventsExecutor", {("1 → 1, def", "s"): 8.3e-6, ("1 → 10, def", "s"): 44e-6}),
    ),
    quoted_from=(
        "rclpy cannot be installed with pip: its figures (7.1.9, ROS 2 Jazzy, Cyclone DDS, Float64, the message made "
        "anew each time) were measured once on an idle virtual machine of two cores with Debian's CPython 3.11.2, on "
        "which a loop of plain Python is 1.44 times as fast as on the CPython 3.11.7 used here."
    ),
)
