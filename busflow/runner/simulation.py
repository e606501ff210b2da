"""Simulation: a graph that has virtual time to itself, to be run as fast as it goes or at a rate."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from contextlib import closing, contextmanager
from typing import Any

from busflow.clock import SimClock
from busflow.launchfile.model.description import ClockMode, LaunchDescription
from busflow.runner.following import Following
from busflow.runner.graph import Graph
from busflow.runner.loops.system import LoopFactory
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.sources import What


@contextmanager
def simulated_graph(
    what: Sequence[What], *, show: Callable[[Graph], object] | None = None, **options: Any
) -> Generator[tuple[Graph, LoopFactory]]:
    """A graph on simulated time, and what makes the loop for `run_graph` to run it on.

    Args:
        what: As `Graph` takes it; a launch file's `clock` says how fast time goes.
        show: Lets the graph be looked into, where its time follows a simulator: that may be in another process.
        options: As `Graph` takes them.
    """
    clocks = [each.clock for each in what if isinstance(each, LaunchDescription)]
    rate = next((clock.rate for clock in clocks if clock.rate is not None), None)
    follows = any(clock.mode is ClockMode.FOLLOW for clock in clocks)
    with closing(VirtualLoop(rate=rate, follows=follows)) as loop:
        clock = SimClock(loop=loop)
        graph = Graph(what, clock=clock, **options)
        if follows:
            following = Following(graph, clock, loop)
            if show is not None:
                show(graph)  # before there is anything to be seen
                graph.on_start.append(following.invite)
        yield graph, lambda: loop
