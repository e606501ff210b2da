"""Nodes that publish stamped messages, and readers of them, slow and fast; one writes the figures down."""

import json
import os
import time
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from busflow import Node, Parameters, QoS
from busflow.msgs.std_msgs import Float64, Float64MultiArray

WORD = 8
SETTLED_S = 1.0
"""How long messages may still be under way once the last one is published."""


def type_of(size: int) -> Any:
    return Float64 if size == WORD else Float64MultiArray


class SlowReadersParameters(Parameters):
    """What a node publishes or reads, and where the figures go."""

    topic: str = "small"
    size: int = WORD
    rate_hz: float = 30.0
    depth: int = 1
    most: int = 0
    blocks_s: float = 0.0
    seconds: float = 1.0
    shares: bool = True
    folder: str = ""


class SlowReadersNode(Node):
    """Shares no memory with other processes where it is told so."""

    parameters: SlowReadersParameters

    def declare(self) -> None:
        if not self.parameters.shares and hasattr(os, "memfd_create"):
            del os.memfd_create  # as on a system without such memory

    def tell(self, found: dict[str, float]) -> None:
        folder = Path(self.parameters.folder)
        (folder / "found.part").write_text(json.dumps(found))
        (folder / "found.part").rename(folder / "found.json")


class Stamper(SlowReadersNode):
    """Publishes the time, in a message of a size."""

    def declare(self) -> None:
        super().declare()
        given = self.parameters
        self.sent = 0
        self.words = np.zeros(given.size // WORD)
        self.out = self.create_publisher(type_of(given.size), given.topic, qos=QoS(depth=given.depth))
        self.create_timer(1 / given.rate_hz, self.tick)

    def tick(self) -> None:
        if self.parameters.most and self.sent == self.parameters.most:
            return
        self.sent += 1
        now = time.monotonic()
        if self.parameters.size == WORD:
            self.out.publish(Float64(data=now))
        else:
            words = self.words.copy()
            words[0] = now
            self.out.publish(Float64MultiArray(data=words))


class Blocking(SlowReadersNode):
    """Notes how old the message is that it gets, and blocks its process; ages of the second half are told."""

    def declare(self) -> None:
        super().declare()
        self.ages: list[tuple[float, float]] = []
        given = self.parameters
        handler = self.on_number if given.size == WORD else self.on_numbers
        self.create_subscription(type_of(given.size), given.topic, handler, qos=QoS(depth=given.depth))

    def on_number(self, number: Float64) -> None:
        self.note(number.data)

    def on_numbers(self, numbers: Float64MultiArray) -> None:
        self.note(float(numbers.data[0]))

    def note(self, stamp: float) -> None:
        now = time.monotonic()
        self.ages.append((now, now - stamp))
        time.sleep(self.parameters.blocks_s)
        took = now - self.ages[0][0]
        if took > self.parameters.seconds:
            late = [age for moment, age in self.ages if moment - self.ages[0][0] > took / 2]
            self.tell({"p50 s": median(late), "worst s": max(late)})
            self.ages.clear()


class Beside(SlowReadersNode):
    """Counts what arrives of two topics, of which another reader of the first is slow."""

    def declare(self) -> None:
        super().declare()
        self.ages: dict[str, list[float]] = {"images": [], "scans": []}
        self.create_subscription(Float64MultiArray, "images", lambda each: self.note("images", each), qos=QoS(depth=1))
        self.create_subscription(Float64MultiArray, "scans", lambda each: self.note("scans", each), qos=QoS(depth=1))

    def note(self, topic: str, numbers: Float64MultiArray) -> None:
        self.ages[topic].append(time.monotonic() - float(numbers.data[0]))

    async def run(self) -> None:
        while not all(self.ages.values()):
            await self.clock.sleep(0.01)
        await self.clock.sleep(self.parameters.seconds + SETTLED_S)
        found: dict[str, float] = {}
        for topic, rate_hz in (("images", 30), ("scans", 40)):
            ages = self.ages[topic]
            found |= {
                f"{topic}, p50 s": median(ages),
                f"{topic}, worst s": max(ages),
                f"{topic}, arrived %": 100 * len(ages) / round(rate_hz * self.parameters.seconds),
            }
        self.tell(found)
