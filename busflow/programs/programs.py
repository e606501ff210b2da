"""Programs: the programs that a run starts, as an extension of its graph."""

from __future__ import annotations

import asyncio
import os
from collections import defaultdict
from collections.abc import AsyncGenerator, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.programs.program import Program, ProgramState
from busflow.runner.extension import Extension

if TYPE_CHECKING:
    from busflow.launchfile.model.description import ProgramSpec
    from busflow.runner.graph import Graph
    from busflow.runner.restarting import Restarting


class Programs(Extension):
    """The programs that a process of the run starts, from before its nodes start until these have ended."""

    def __init__(self, graph: Graph, specs: Sequence[ProgramSpec]) -> None:
        self._graph = graph
        stated = {name: value for each in graph.descriptions for name, value in each.environment.items()}
        # Python programs hold back what they print into a pipe, unless they are asked not to.
        around = {"PYTHONUNBUFFERED": "1", **os.environ, **stated}
        self.programs: list[Program] = [Program(graph, spec, {**around, **spec.env}) for spec in specs]
        self._by_name = {program.name: program for program in self.programs}
        self.end_s: float = max((self._longest_end_s(program) for program in self.programs), default=0.0)

    def _longest_end_s(self, program: Program) -> float:
        """Return how long it may take until a program has ended: those that depend on it end first."""
        later = [each for each in self.programs if program.name in each.spec.supervision.depends_on]
        own_s = 2 * program.spec.grace_s + timeouts.current.program_end
        return own_s + max(map(self._longest_end_s, later), default=0.0)

    def prerequisites(self) -> Sequence[Restarting]:
        """Return the programs: nodes may depend on them."""
        return self.programs

    def begin(self) -> None:
        """Find what each program depends on, among the nodes of this process and the other programs."""
        known: dict[str, Restarting] = {each.name: each for each in self._graph.supervisors}
        known |= self._by_name
        for program in self.programs:
            program.depend(known, program.spec.supervision.depends_on)

    @asynccontextmanager
    async def surround(self) -> AsyncGenerator[None]:
        """Start the programs; at the end wait until all have ended, whatever has happened in between."""
        problem: BaseException | None = None
        async with asyncio.TaskGroup() as tasks:
            for program in self.programs:
                tasks.create_task(program.live(), name=f"busflow.program.{program.name}")
            stopping = tasks.create_task(self._stop_in_order(), name="busflow.programs")
            try:
                yield
            except BaseException as error:  # noqa: BLE001  # raised again, once the programs have ended
                problem = error
                stopping.cancel()
                for program in self.programs:
                    program.ask_to_stop()
        if problem is not None:
            raise problem

    async def _stop_in_order(self) -> None:
        """Stop each program, when the run ends and what depends on the program has ended."""
        await self._graph.course.ending.wait()
        dependents: defaultdict[str, list[asyncio.Event]] = defaultdict(list)
        for supervisor in self._graph.supervisors:
            for name in supervisor.supervision.depends_on:
                dependents[name].append(supervisor.ended)
        for program in self.programs:
            for name in program.spec.supervision.depends_on:
                dependents[name].append(program.ended)
        await asyncio.gather(*(_stop(program, dependents[program.name]) for program in self.programs))

    def is_finished(self) -> bool:
        """Return whether every program has ended."""
        return all(program.state in {ProgramState.ENDED, ProgramState.FAILED} for program in self.programs)

    def about(self) -> Mapping[str, Any]:
        """Return what `busflow ps` and `busflow doctor` show of the programs."""
        return {"programs": [_fact(program) for program in self.programs]}

    def sections(self) -> Mapping[str, object]:
        """Return the programs."""
        return {"programs": tuple(program.statistics() for program in self.programs)}


def _fact(program: Program) -> dict[str, Any]:
    account = program.statistics()
    return {
        "program": account.name,
        "pid": account.pid,
        "state": account.state,
        "restarts": account.restarts,
        "command": list(account.command),
        "last_failure": account.fates[-1] if account.fates else "",
    }


async def _stop(program: Program, dependents: Sequence[asyncio.Event]) -> None:
    for ended in dependents:
        await ended.wait()
    program.ask_to_stop()
