"""Receiver: a handler that does next to nothing, so that what is measured is the way to it."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from benchmarks.peers import Handler, Publish


class Receiver:
    """Counts what it is given."""

    def __init__(self) -> None:
        self.count = 0

    def take(self, _message: Any) -> None:
        self.count += 1

    async def take_async(self, _message: Any) -> None:
        self.count += 1

    def handler(self, kind: str) -> Handler:
        """What is to be called: a `def`, or an `async def`."""
        return self.take_async if kind == "async def" else self.take


class Relay(Receiver):
    """Hands on what it is given."""

    forward: Publish

    def take(self, message: Any) -> None:
        self.count += 1
        self.forward(message)

    async def take_async(self, message: Any) -> None:
        self.count += 1
        self.forward(message)


class AwaitingRelay(Relay):
    """Hands on what it is given, where that has to be awaited."""

    async def take_async(self, message: Any) -> None:
        self.count += 1
        await self.forward(message)


class Stopwatch(Receiver):
    """Notes when it is given something."""

    def __init__(self) -> None:
        super().__init__()
        self.arrived_ns: list[int] = []

    def take(self, _message: Any) -> None:
        self.arrived_ns.append(time.perf_counter_ns())
        self.count += 1

    async def take_async(self, _message: Any) -> None:
        self.arrived_ns.append(time.perf_counter_ns())
        self.count += 1


def received(receivers: Sequence[Receiver]) -> int:
    """What all of them were given together."""
    return sum(receiver.count for receiver in receivers)
