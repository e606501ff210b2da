"""A handler that never comes back is named on virtual time, where nothing else would end the wait."""

import threading

import pytest

from busflow import Graph, Node, timer
from busflow.clock import SimClock, perf_counter
from busflow.errors import NodeFailed
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.loops.virtual_test import run_virtual
from busflow.testing import harness, virtual_time


class Endless(Node):
    @timer(0.1)
    def tick(self):
        while True:
            pass


class Slow(Node):
    """Computes until it is named, or for a minute."""

    def __init__(self):
        super().__init__()
        self.named = threading.Event()

    @timer(0.1)
    def tick(self):
        end = perf_counter() + 60
        while not self.named.is_set() and perf_counter() < end:
            pass


@virtual_time(thread_s=0.2)
async def test_endless_handler_fails_its_test_with_its_line():
    with pytest.raises(
        NodeFailed, match=r"(?s)/endless failed in Endless.tick.*test_stuck_handlers.py:1[89].*0.2 s of real"
    ):
        async with harness(Endless) as lab:
            await lab.advance(10)


def test_slow_handler_of_a_run_is_only_named(monkeypatch):
    monkeypatch.setattr("busflow.runner.stuck_handlers._WARN_S", 0.1)
    slow, lines = Slow(), []

    def sink(record):
        if "has not come back" in record.event:
            lines.append((record.node, record.values["handler"], "in tick" in record.values["stack"]))
            slow.named.set()

    async def main(clock):
        async with Graph([slow], clock=clock, sinks=(sink,)) as graph:
            await graph.clock.sleep(0.15)

    loop = VirtualLoop(thread_s=0.4, ends_handlers=False)
    run_virtual(main(SimClock(loop=loop)), name="run", loop=loop)
    assert lines == [("/slow", "timer tick", True)]
