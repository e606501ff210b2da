"""Trials: a launch file run on simulated time with many seeds, and what was wrong with any of them."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from busflow.errors import Deadlock, Fault, NodeFailed, Problem, Stray
from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.faults import problems
from busflow.launchfile.yaml.value import Origin, Source, Value
from busflow.runner.graph import Graph
from busflow.runner.simulation import simulated_graph
from busflow.testing.expectations import Expectations, expectations_of


@dataclass(slots=True)
class Trials:
    """What came of running a launch file with one seed after another."""

    description: LaunchDescription
    for_s: float
    seeds: list[int] = field(default_factory=list[int])
    """The seeds that were tried."""
    _wrong: dict[str, tuple[Fault, list[int]]] = field(default_factory=dict[str, tuple[Fault, list[int]]])
    """By what it is about: how it was wrong first, and with which seeds."""

    def run(self, seeds: Iterable[int]) -> None:
        """Run once with each seed.

        Raises:
            LaunchError: The file cannot run.
        """
        for seed in seeds:
            self.seeds.append(seed)
            for key, fault in self._faults(seed):
                self._wrong.setdefault(key, (fault, []))[1].append(seed)

    def problems(self) -> list[Problem]:
        """What was wrong, each with the first seed that shows it."""
        stated = self.description.expect or Value({}, Origin(Source.FILE))
        found: list[Problem] = []
        for fault, seeds in self._wrong.values():
            others = f", as with {len(seeds) - 1} others" if len(seeds) > 1 else ""
            text = f"{fault.message} (seed {seeds[0]}{others}, of {len(self.seeds)})"
            found += problems([Fault(fault.path, text, fault.fix, fault.code)], stated, noun="expectation")
        return found

    def _faults(self, seed: int) -> list[tuple[str, Fault]]:
        """What was wrong with one seed, each under what it is about."""
        unhurried = replace(self.description, clock=replace(self.description.clock, rate=None))
        with simulated_graph([unhurried], seed=seed) as (graph, loop_factory):
            expectations = Expectations(graph, expectations_of(self.description))
            try:
                with asyncio.Runner(loop_factory=loop_factory) as runner:
                    runner.run(_run(graph, self.for_s))
            except (NodeFailed, Stray, Deadlock) as error:
                return [(str(error).partition("\n")[0], Fault((), str(error), code="failed"))]
            return [(str(fault.path), fault) for fault in expectations.broken()]


async def _run(graph: Graph, for_s: float) -> None:
    async with graph:
        await graph.clock.sleep(for_s)
        await graph.clock.settle()
