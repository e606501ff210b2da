"""Simulation: a graph that has virtual time to itself, to be run as fast as it goes or at a rate."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import closing, contextmanager
from typing import Any

from busflow.clock import SimClock
from busflow.launchfile.description import LaunchDescription
from busflow.runner import Graph, LoopFactory, What
from busflow.testing.loop import VirtualLoop


@contextmanager
def simulated_graph(what: Sequence[What], **options: Any) -> Generator[tuple[Graph, LoopFactory]]:
    """A graph on simulated time, and what makes the loop for `run_graph` to run it on.

    Args:
        what: As `Graph` takes it; a launch file's `clock` says how fast time goes.
        options: As `Graph` takes them.
    """
    rates = [each.clock.rate for each in what if isinstance(each, LaunchDescription)]
    with closing(VirtualLoop(rate=next((rate for rate in rates if rate is not None), None))) as loop:
        yield Graph(what, clock=SimClock(loop=loop), **options), lambda: loop
