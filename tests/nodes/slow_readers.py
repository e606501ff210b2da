"""A writer, readers of which each is slow in a way of its own, and one beside them that loses nothing.

The writer takes the ways in turn: it publishes number 0 on each of a reader's topics, publishes all others while the
reader is at work with it, and lets the reader go on. What a reader has received, and its account, stand in its log.
"""

import asyncio
import os
import signal
import threading
from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from busflow import Message, Node, Parameters, PublisherMatched, QoS, on_event, service
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger

KINDS: dict[str, tuple[Any, int, int]] = {"small": (Int64, 3, 400), "large": (Image, 1, 40)}
"""Of each size the type, the depth of its slow reader, and the last number."""
WAYS = ("awaits", "blocks", "late", "stopped", "killed", "reborn")
"""The topics of each reader. The reader that is killed reads the topics of `reborn` too, from its next start on."""
TOPICS = [(overflow, size) for overflow in ("drop_oldest", "drop_newest") for size in KINDS]
BYTES = 70_000
PATIENCE_S = 100.0
"""The limit of a call, on however slow a machine."""


def name_of(way: str, overflow: str, size: str) -> str:
    return f"{way}/{overflow}/{size}"


def every_topic(method: Any) -> Any:
    """Have a method handle the events of all topics."""
    for way in WAYS:
        for topic in TOPICS:
            method = on_event(name_of(way, *topic))(method)
    return method


def numbered(size: str, number: int) -> Message:
    if size == "small":
        return Int64(data=number)
    return Image(height=number, data=np.full(BYTES, number % 256, np.uint8))


def number_of(message: Any) -> int:
    if isinstance(message, Int64):
        return message.data
    if len(message.data) != BYTES or not (message.data == message.height % 256).all():
        raise ValueError(f"image {message.height} is torn")
    return message.height


class WayParameters(Parameters):
    """In which ways readers are slow."""

    ways: tuple[str, ...] = ()
    way: str = ""
    alone: bool = False
    """Whether all nodes are in one process, without the reader beside."""


class Writer(Node):
    """Publishes, and stops and kills readers."""

    parameters: WayParameters

    def declare(self) -> None:
        self.outs = {
            (way, *topic): self.create_publisher(KINDS[topic[1]][0], name_of(way, *topic))
            for way in WAYS
            for topic in TOPICS
        }
        self.readers: Counter[str] = Counter()
        self.changed = asyncio.Event()
        ways = self.parameters.ways
        asked = [f"{way}/{word}" for way in ways for word in ("begin", "enter", "settle")]
        asked += [] if self.parameters.alone else [f"beside/{way}" for way in ways]
        self.calls = {name: self.create_client(Trigger, name) for name in asked}

    async def start(self) -> None:
        for way in {"blocks", "killed"}.intersection(self.parameters.ways):
            Path(way).unlink(missing_ok=True)
            os.mkfifo(way)

    async def ask(self, service: str) -> str:
        await self.calls[service].ready(timeout=PATIENCE_S)
        return (await self.calls[service].call(timeout=PATIENCE_S)).message

    async def beside(self, way: str) -> None:
        """Wait until the fast reader has everything."""
        if not self.parameters.alone:
            await self.ask(f"beside/{way}")

    async def run(self) -> None:
        for way in self.parameters.ways:
            self.pid = int(await self.ask(f"{way}/begin"))
            await self.matched(way, 1 if self.parameters.alone else 2)
            await getattr(self, way)()
            await self.beside(way)
            await self.ask(f"{way}/settle")
        self.log.info("done")

    @every_topic
    def on_matched(self, event: PublisherMatched) -> None:
        self.readers[event.topic] = event.current
        self.changed.set()

    async def matched(self, way: str, readers: int) -> None:
        """Wait until each of its topics has so many readers."""
        while any(self.readers[f"/{name_of(way, *topic)}"] != readers for topic in TOPICS):
            self.changed.clear()
            await self.changed.wait()

    def first(self, way: str) -> None:
        for topic in TOPICS:
            self.outs[way, *topic].publish(numbered(topic[1], 0))

    def others(self, way: str) -> None:
        """Publish all others at once: in one turn of the loop."""
        for topic in TOPICS:
            for number in range(1, KINDS[topic[1]][2] + 1):
                self.outs[way, *topic].publish(numbered(topic[1], number))

    async def others_in_turns(self, way: str) -> None:
        """Publish each in a turn of its own, all topics together."""
        last = max(last for _, _, last in KINDS.values())
        for number in range(1, last + 1):
            for topic in TOPICS:
                if number <= KINDS[topic[1]][2]:
                    self.outs[way, *topic].publish(numbered(topic[1], number))
            await asyncio.sleep(0)

    async def entered(self, way: str, reader: str) -> None:
        self.first(way)
        await self.ask(f"{reader}/enter")  # until then messages may be held, no more of them than the reader's depth
        await self.others_in_turns(way)

    async def awaits(self) -> None:
        await self.entered("awaits", "awaits")

    async def late(self) -> None:
        await self.entered("late", "late")

    async def blocks(self) -> None:
        if self.parameters.alone:
            threading.Thread(target=self.others_while_blocked).start()
            self.first("blocks")
            return
        self.first("blocks")
        gate = await self.run_sync(open, "blocks", "w")
        await self.others_in_turns("blocks")
        await self.beside("blocks")
        gate.close()

    def others_while_blocked(self) -> None:
        """Publish from a thread, since the loop stands still."""
        with Path("blocks").open("w"):
            self.others("blocks")

    async def stopped(self) -> None:
        self.first("stopped")
        os.kill(self.pid, signal.SIGSTOP)
        try:
            while Path(f"/proc/{self.pid}/stat").read_text().rpartition(")")[2].split()[0] != "T":
                await asyncio.sleep(0)
            self.others("stopped")
            await self.beside("stopped")
        finally:
            os.kill(self.pid, signal.SIGCONT)

    async def killed(self) -> None:
        self.first("killed")
        with await self.run_sync(open, "killed", "w"):
            Path("killed").unlink()
            self.others("killed")
            os.kill(self.pid, signal.SIGKILL)
        await self.matched("reborn", 0)
        await self.matched("reborn", 1)
        await self.entered("reborn", "killed")


class Reader(Node):
    """Reads four topics, and is slow in one way; `settle` is answered once it has accounted for all of them."""

    parameters: WayParameters
    is_at_work = False

    def declare(self) -> None:
        self.received: dict[tuple[str, str], list[int]] = {topic: [] for topic in TOPICS}
        self.subscriptions: dict[tuple[str, str], Any] = {}
        if self.parameters.way != "late":
            self.subscribe(self.parameters.way)
        if self.parameters.way == "killed":
            self.received = {topic: [] for topic in TOPICS}
            self.subscribe("reborn")

    def subscribe(self, way: str) -> None:
        for topic in TOPICS:
            overflow, size = topic
            kind, depth, _ = KINDS[size]
            handler = self.waiting(topic) if way == "awaits" else self.plain(self.received[topic])
            qos = QoS(depth=depth, overflow=overflow)
            self.subscriptions[topic] = self.create_subscription(kind, name_of(way, *topic), handler, qos=qos)

    def plain(self, received: list[int]) -> Any:
        def on_message(message: Any) -> None:
            received.append(number_of(message))
            if not self.is_at_work and Path(self.parameters.way).exists():
                self.is_at_work = True
                with Path(self.parameters.way).open() as gate:  # until the writer opens it too
                    gate.read()

        return on_message

    def waiting(self, topic: tuple[str, str]) -> Any:
        async def on_message(message: Any) -> None:
            self.received[topic].append(number_of(message))
            await self.counted(topic)

        return on_message

    async def counted(self, topic: tuple[str, str]) -> None:
        while self.subscriptions[topic].published <= KINDS[topic[1]][2]:
            await self.clock.sleep(0.01)

    @service(Trigger, "~/begin")
    async def begin(self, _request: Trigger.Request) -> Trigger.Response:
        if not self.subscriptions:
            self.subscribe("late")
        return Trigger.Response(success=True, message=str(os.getpid()))

    @service(Trigger, "~/enter")
    async def enter(self, _request: Trigger.Request) -> Trigger.Response:
        while not all(self.received.values()):
            await self.clock.sleep(0.01)
        return Trigger.Response(success=True)

    @service(Trigger, "~/settle")
    async def settle(self, _request: Trigger.Request) -> Trigger.Response:
        for topic in TOPICS:
            await self.counted(topic)
            account = self.subscriptions[topic].statistics
            while account().published > account().delivered + account().dropped:
                await self.clock.sleep(0.01)
            found = account()
            self.log.info(
                "outcome",
                topic=name_of(self.parameters.way, *topic),
                received=str(self.received[topic]),
                account=str([found.published, found.delivered, found.dropped, dict(found.drops)]),
            )
        return Trigger.Response(success=True)


class Beside(Node):
    """Reads the same topics with room for everything, and says so where something is missing."""

    parameters: WayParameters

    def declare(self) -> None:
        self.received: dict[str, list[int]] = {}
        self.subscriptions: dict[str, Any] = {}
        for way in self.parameters.ways:
            for topic in TOPICS:
                self.subscribe(name_of(way, *topic), topic)
            self.create_service(Trigger, f"~/{way}", partial(self.settle, way))

    def subscribe(self, name: str, topic: tuple[str, str]) -> None:
        received = self.received[name] = []
        kind, _, last = KINDS[topic[1]]
        self.subscriptions[name] = self.create_subscription(
            kind, name, lambda each: received.append(number_of(each)), QoS(depth=last + 1, overflow=topic[0])
        )

    async def settle(self, way: str, _request: Trigger.Request) -> Trigger.Response:
        for topic in TOPICS:
            name, expected = name_of(way, *topic), [*range(KINDS[topic[1]][2] + 1)]
            account = self.subscriptions[name].statistics
            while account().published < len(expected) or account().queued:
                await self.clock.sleep(0.01)
            if self.received[name] != expected:
                self.log.error("missing", topic=name, received=str(self.received[name]), drops=str(account().drops))
        return Trigger.Response(success=True)
