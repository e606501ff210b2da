"""A handler that never comes back is named on virtual time, where nothing else would end the wait."""

import ctypes
import io
import os
import pdb  # noqa: T100  # what a breakpoint() runs
import re
import select
import sys
import threading

import pytest

from busflow import Graph, Node, timer
from busflow.clock import SimClock
from busflow.errors import NodeFailed
from busflow.runner import standard_error
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.loops.virtual_test import run_virtual
from busflow.testing import harness, virtual_time


class Endless(Node):
    @timer(0.1)
    def tick(self):
        while True:
            pass


class Slow(Node):
    """Computes until it is named, calling busflow meanwhile."""

    def __init__(self, named):
        super().__init__()
        self.named = named

    @timer(0.1)
    def tick(self):
        while not select.select([self.named], [], [], 0)[0]:
            self.log.debug("on")


@virtual_time(thread_s=0.2)
async def test_endless_handler_fails_its_test_with_its_line():
    with pytest.raises(NodeFailed, match=r"(?s)/endless .* Endless\.tick.*test_stuck_handlers\.py:2[4567].* 0\.2 s "):
        async with harness(Endless) as lab:
            await lab.advance(10)


@virtual_time(thread_s=0.8)
async def test_pause_of_the_process_fails_no_handler():
    """As after Ctrl-Z, or while the machine is suspended; here the handler holds the interpreter's lock."""

    class Paused(Node):
        @timer(0.1)
        def tick(self):
            threading.Event().wait(0.3)  # until it was seen at work
            ctypes.PyDLL(None).usleep(800_000)
            threading.Event().wait(0.01)

    async with harness(Paused) as lab:
        await lab.advance(0.1)


def test_slow_handler_of_a_run_is_only_named(monkeypatch, limits):
    """On standard error, and not in the log, which is the same on a slow machine."""
    reading, writing = os.pipe()
    monkeypatch.setattr(standard_error, "descriptor", writing)
    limits(stuck_warning=0.1)
    slow, lines = Slow(reading), []

    async def main(clock):
        async with Graph([slow], clock=clock, sinks=(lines.append,)) as graph:
            await graph.clock.sleep(0.15)

    loop = VirtualLoop(thread_s=0.4, ends_handlers=False)
    run_virtual(main(SimClock(loop=loop)), name="run", loop=loop)
    named = os.read(reading, 4096).decode()
    os.close(reading)
    os.close(writing)
    assert named.startswith("busflow: /slow: timer tick ")
    assert re.search(r" 0\.1 s .*test_stuck_handlers\.py:\d+ in tick", named)
    assert lines == []


@pytest.fixture
def tracer():
    """What traces this thread, such as a measurement of coverage, goes on after a debugger."""
    before = sys.gettrace()
    yield
    sys.settrace(before)


@pytest.mark.usefixtures("tracer")
@virtual_time(thread_s=0.2)
async def test_handler_in_a_debugger_is_left_alone():
    """A breakpoint waits for a person, however long."""

    class Debugged(Node):
        @timer(0.1)
        def tick(self):
            stopped = pdb.Pdb(stdin=Waiting(), stdout=io.StringIO(), nosigint=True, readrc=False)
            stopped.set_trace()

    class Waiting(io.StringIO):
        def readline(self, *_):
            threading.Event().wait(0.8)
            return "continue\n"

    async with harness(Debugged) as lab:
        await lab.advance(0.1)
