"""A graph as the whole program: it runs for its time or until its end, and its failure is the program's."""

import asyncio
import os
import subprocess
import sys
from collections.abc import Generator, Sequence
from contextlib import contextmanager

import pytest

import busflow
from busflow import Graph, Node, supervised, timer
from busflow.errors import ExitCode, LaunchError, NodeFailed
from busflow.runner.assembly import Given, Kind, Run
from busflow.runner.loops.system import LoopFactory
from busflow.runner.run import run_graph
from busflow.timeouts import VARIABLE

SHIELDED = """
import asyncio, os, signal, sys
import anyio, busflow

class Shielded(busflow.Node):
    async def start(self) -> None:
        os.kill(os.getpid(), signal.SIGINT)

    async def stop(self) -> None:
        with anyio.CancelScope(shield=True):
            await asyncio.Event().wait()

sys.exit(busflow.run(Shielded, inspect=False))
"""

STUCK = """
import sys, threading
import busflow
from busflow.runner.run import run_graph

class Stuck(busflow.Node):
    async def run(self) -> None:
        threading.Event().wait()

sys.exit(run_graph(busflow.launch(Stuck), for_s=0.01))
"""


class Ticker(Node):
    ticks = 0

    @timer(hz=10)
    def tick(self) -> None:
        self.ticks += 1


class Failing(Node):
    @timer(hz=1)
    def tick(self) -> None:
        raise ValueError("no contact")


class SecondTime(Ticker):
    """Starts at its second attempt, after two seconds in all."""

    attempts = 0

    async def start(self) -> None:
        SecondTime.attempts += 1
        await self.clock.sleep(1)
        if SecondTime.attempts == 1:
            raise OSError("not yet")


class Short(Node):
    async def run(self) -> None:
        self.log.info("done")


class Unstartable(Node):
    async def start(self) -> None:
        raise OSError("no such port")


@contextmanager
def simulated(nodes: Sequence[type[Node]]) -> Generator[tuple[Graph, LoopFactory]]:
    """A graph on simulated time, and the function that returns its loop."""
    with Run(nodes, Kind.TEST, Given(simulated=True)) as run:
        yield run.build(), run.loop_factory


def test_a_virtual_limit_ends_the_run():
    with simulated([Ticker]) as (graph, loop):
        assert run_graph(graph, for_s=360.0, loop_factory=loop) is ExitCode.OK
        assert graph.node(Ticker).ticks == 3600


def test_virtual_limit_counts_from_the_start_of_all_nodes():
    SecondTime.attempts = 0
    with simulated([supervised(SecondTime, restart="on-failure")]) as (graph, loop):
        assert run_graph(graph, for_s=60.0, loop_factory=loop) is ExitCode.OK
        assert graph.node(SecondTime).ticks == 600


@pytest.mark.parametrize("for_s", [None, 60.0])
def test_a_graph_without_work_ends_early(for_s: float | None):
    with simulated([Short]) as (graph, loop):
        assert run_graph(graph, for_s=for_s, loop_factory=loop) is ExitCode.OK


def test_a_failed_node_fails_the_program(golden):
    with simulated([Ticker, Failing]) as (graph, loop):
        with golden.raises(NodeFailed):
            run_graph(graph, for_s=60.0, loop_factory=loop)
        assert graph.exit_code is ExitCode.FAILED


def test_a_node_that_cannot_start_fails_it(golden):
    with simulated([Unstartable]) as (graph, loop), golden.raises(NodeFailed):
        run_graph(graph, loop_factory=loop)


def test_an_invalid_graph_starts_nothing():
    class Doubtful(Ticker):
        async def start(self) -> None:
            raise AssertionError

    with simulated([Doubtful, Doubtful]) as (graph, loop), pytest.raises(LaunchError, match="/doubtful"):
        run_graph(graph, loop_factory=loop)


def test_the_nodes_run_on_the_given_loop():
    made: list[asyncio.AbstractEventLoop] = []

    class Seer(Node):
        async def run(self) -> None:
            assert [asyncio.get_running_loop()] == made

    def factory() -> asyncio.AbstractEventLoop:
        made.append(asyncio.new_event_loop())
        return made[0]

    assert run_graph(busflow.launch(Seer), loop_factory=factory) is ExitCode.OK
    assert made


def ended(program: str, limits: str) -> tuple[int, str]:
    """Run a program to its end: its exit code, and its standard error."""
    env = {**os.environ, VARIABLE: limits}
    done = subprocess.run([sys.executable, "-c", program], stderr=subprocess.PIPE, text=True, env=env, timeout=60)
    return done.returncode, done.stderr


def test_a_loop_that_turns_ends_its_run():
    code, log = ended(SHIELDED, "grace=0.1,around=inf")
    assert code == ExitCode.INTERRUPTED
    assert "left behind" in log
    assert "did not end" not in log, "it was ended by force"


def test_time_limit_ends_a_run_that_stands_still():
    code, log = ended(STUCK, "grace=0.1,around=0")
    assert (code, "did not end" in log) == (ExitCode.FAILED, True), log
