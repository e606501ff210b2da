"""Checks the supervision of nodes and programs: their dependencies, and whether the nodes can be restarted."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from busflow.errors import Problem
from busflow.launchfile.model.description import ProgramSpec
from busflow.launchfile.model.problems import problem_at
from busflow.launchfile.model.supervision import Condition, Restart
from busflow.node.supervision import cycle
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.runner.planning.planned_node import PlannedNode


def supervision_problems(nodes: Sequence[PlannedNode], programs: Sequence[ProgramSpec] = ()) -> Iterator[Problem]:
    """Yield dependencies and restarts that are impossible for these nodes and programs."""
    known: dict[str, PlannedNode | ProgramSpec] = {planned.runtime.full_name: planned for planned in nodes}
    known |= {program.name: program for program in programs}
    for name, each in known.items():
        yield from _unmet_dependencies(name, each, known)
    for planned in nodes:
        yield from _not_restartable(planned)
    circle = cycle(
        {name: [other for other in each.supervision.depends_on if other in known] for name, each in known.items()}
    )
    if circle:
        text = f"{' waits for '.join(circle)}: none of them would ever start"
        yield _at_dependency(known[circle[0]], circle[1], "dependency-cycle", text, "leave one of them out")


def _unmet_dependencies(
    name: str, waiting: PlannedNode | ProgramSpec, known: Mapping[str, PlannedNode | ProgramSpec]
) -> Iterator[Problem]:
    for other, condition in waiting.supervision.depends_on.items():
        found = known.get(other)
        if found is None:
            text = f"{name} depends on {other}, which is not a node or program of this graph"
            fix = did_you_mean(other, known.keys() - {name}, none="leave it out: the graph has no other node")
            yield _at_dependency(waiting, other, "unknown-node", text, fix)
        elif isinstance(found, ProgramSpec):
            yield from _unmet_by_program(name, waiting, found, condition)
        elif condition is Condition.FIRST_MESSAGE and not found.publishers:
            text = f"{name} waits for the first message of {other}, which publishes nothing"
            yield _at_dependency(waiting, other, "no-publisher", text, "write ready instead of first_message")


def _unmet_by_program(
    name: str, waiting: PlannedNode | ProgramSpec, program: ProgramSpec, condition: Condition
) -> Iterator[Problem]:
    if condition is Condition.FIRST_MESSAGE:
        text = f"{name} waits for the first message of {program.name}, a program, whose messages are not seen"
        yield _at_dependency(
            waiting, program.name, "no-publisher", text, "write ready or started instead of first_message"
        )
    elif condition is Condition.READY and program.ready is None:
        text = f"{name} waits until {program.name} is ready, and nothing says when that is"
        fix = f"write started, or below {program.name.rpartition('/')[2]} a text that it prints then: ready: TEXT"
        yield _at_dependency(waiting, program.name, "never-ready", text, fix)


def _not_restartable(planned: PlannedNode) -> Iterator[Problem]:
    """Yield a restart that is impossible because the node's class needs further arguments."""
    if planned.supervision.restart.when is Restart.NEVER:
        return
    kind = type(planned.node)
    try:
        inspect.signature(kind).bind(planned.node.parameters, name=planned.runtime.name)
    except TypeError as error:
        text = f"{planned.runtime.full_name} cannot be restarted: {kind.__name__}(parameters, name=…) has {error}"
        fix = f"let {kind.__name__}.__init__ take (parameters, *, name) as Node's does, or leave restart out"
        yield Problem("restart", text, fix, planned.place)


def _at_dependency(waiting: PlannedNode | ProgramSpec, other: str, code: str, message: str, fix: str | None) -> Problem:
    """Return a problem at the place where the launch file names the other node or program."""
    spec = waiting if isinstance(waiting, ProgramSpec) else waiting.spec
    origin = spec.depends_origins.get(other) if spec else None
    return Problem(code, message, fix) if origin is None else problem_at(code, message, fix, origin)
