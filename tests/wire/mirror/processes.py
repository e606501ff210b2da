"""Processes of a run, each with a real session and a graph of its own, here on one event loop."""

import asyncio
import os
import time
from contextlib import asynccontextmanager

from busflow import launch
from busflow.runner.extension import Extension
from busflow.wire.mirror.membership import Membership
from busflow.wire.zenoh.run_directory import RunCard

PATIENCE_S = 60.0


class Process(Extension):
    """What a process of a run is to its barrier, here without a process of its own."""

    def __init__(self, node, name, directory, *others):
        self.graph, self.changes = launch(node), []
        self.membership = Membership(
            self.graph,
            directory,
            RunCard("robot", os.getpid(), time.time_ns()),
            process=name,
            socket=f"{name}.sock",
            earlier=[f"{other}.sock" for other in others if other < name],
            on_change=lambda *change: self.changes.append(change),
        )
        self.others = others
        self.graph.attach(self.membership)
        self.graph.attach(self)
        self.waits = asyncio.Event()

    @property
    def barrier(self):
        return self.membership.barrier

    @asynccontextmanager
    async def surround(self):
        self.barrier.begin()
        self.waits.set()
        await self.barrier.passed(self.others, unless=self.graph.ending)
        yield


def conversation(make):
    """Run a test on an event loop, and end what it leaves."""

    async def main():
        async with asyncio.timeout(PATIENCE_S):
            await make()

    asyncio.run(main())


async def until(condition):
    while not condition():  # noqa: ASYNC110  # what other sessions bring comes from threads that set no event
        await asyncio.sleep(0.01)
