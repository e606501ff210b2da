"""Checks the supervision of nodes against the graph: their dependencies, and whether they can be restarted."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from busflow.errors import Problem
from busflow.launchfile.model.problems import problem_at
from busflow.node.supervision import Condition, Restart, cycle
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.launchfile.check.planned_node import PlannedNode


def supervision_problems(members: Sequence[PlannedNode]) -> Iterator[Problem]:
    """Yield dependencies and restarts that are impossible for these nodes."""
    by_name = {member.runtime.full_name: member for member in members}
    for member in members:
        yield from _unmet_dependencies(member, by_name)
        yield from _not_restartable(member)
    names = {
        name: [other for other in member.supervision.depends_on if other in by_name] for name, member in by_name.items()
    }
    circle = cycle(names)
    if circle:
        text = f"{' waits for '.join(circle)}: none of them would ever start"
        yield _at_dependency(by_name[circle[0]], circle[1], "dependency-cycle", text, "leave one of them out")


def _unmet_dependencies(member: PlannedNode, by_name: Mapping[str, PlannedNode]) -> Iterator[Problem]:
    name = member.runtime.full_name
    for other, condition in member.supervision.depends_on.items():
        if other not in by_name:
            text = f"{name} depends on {other}, which is no node of this graph"
            fix = did_you_mean(other, by_name.keys() - {name}, none="leave it out: the graph has no other node")
            yield _at_dependency(member, other, "unknown-node", text, fix)
        elif condition is Condition.FIRST_MESSAGE and not by_name[other].publishers:
            text = f"{name} waits for the first message of {other}, which publishes nothing"
            yield _at_dependency(member, other, "no-publisher", text, "write ready instead of first_message")


def _not_restartable(member: PlannedNode) -> Iterator[Problem]:
    """Yield a restart that is impossible because the node's class needs further arguments."""
    if member.supervision.restart.when is Restart.NEVER:
        return
    kind = type(member.node)
    try:
        inspect.signature(kind).bind(member.node.parameters, name=member.runtime.name)
    except TypeError as error:
        text = f"{member.runtime.full_name} cannot be restarted: {kind.__name__}(parameters, name=…) has {error}"
        fix = f"let {kind.__name__}.__init__ take (parameters, *, name) as Node's does, or leave restart out"
        yield Problem("restart", text, fix, member.place)


def _at_dependency(member: PlannedNode, other: str, code: str, message: str, fix: str | None) -> Problem:
    """Return a problem at the place where the launch file names the other node."""
    origin = member.spec.depends_origins.get(other) if member.spec else None
    return Problem(code, message, fix) if origin is None else problem_at(code, message, fix, origin)
