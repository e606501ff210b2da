"""Processes of a run, each with a real session and a graph of its own, here on one event loop."""

import asyncio
import os
import time
from contextlib import asynccontextmanager

from busflow import launch
from busflow.runner.extension import Extension
from busflow.runner.graph import Graph
from busflow.wire.mirror.membership import Membership
from busflow.wire.mirror.mirror import Mirror
from busflow.wire.zenoh.run_directory import RunCard, find_run
from busflow.wire.zenoh.session import open_session

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
        await self.barrier.passed(self.others, unless=self.graph.course.ending)
        yield


class Shown(Extension):
    """A graph that shows itself to the run from when it starts."""

    def __init__(self, mirror):
        self.begin = mirror.begin


@asynccontextmanager
async def second_process(node, log=lambda _record: None):
    """A graph of this process in the run that is there, and a function that ends its session."""
    graph = Graph((node,), sinks=(log,), embedded=True)
    directory = find_run().directory
    session = open_session(directory, listen="second.sock")
    mirror = Mirror(graph, session, RunCard("second", os.getpid(), time.time_ns()), "second", {}, lines=directory)
    graph.attach(Shown(mirror))
    try:
        async with asyncio.timeout(PATIENCE_S), graph:
            yield graph, session.close
    finally:
        mirror.close()


async def until(condition):
    while not condition():  # noqa: ASYNC110  # what other sessions bring comes from threads that set no event
        await asyncio.sleep(0.01)
