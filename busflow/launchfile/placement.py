"""Placement: which process of a run each node is in."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING

from busflow.errors import Problem, Severity
from busflow.launchfile.faults import problem_at

if TYPE_CHECKING:
    from busflow.launchfile.description import LaunchDescription, ProcessSpec

MAIN = "main"
"""The process that `busflow run` itself is."""


class Spread(StrEnum):
    """How nodes are put into processes."""

    FILE = "file"
    """As the launch file says."""
    ONE = "one"
    """All in the main process."""
    AUTO = "auto"
    """Each in one of its own, unless the file says which."""


@dataclass(frozen=True, slots=True)
class Placement:
    """The processes of a run and their nodes."""

    nodes: Mapping[str, tuple[str, ...]]
    """By process, the full names of its nodes; the main one first."""
    specs: Mapping[str, ProcessSpec]
    """By process, what the launch file says of it; the main one has none."""

    def process_of(self, node: str) -> str:
        """Where a node is; whatever is nowhere else is in the main process."""
        return next((process for process, nodes in self.nodes.items() if node in nodes), MAIN)

    @property
    def others(self) -> tuple[str, ...]:
        """All but the main one."""
        return tuple(process for process in self.nodes if process != MAIN)


def placed(description: LaunchDescription, spread: Spread = Spread.FILE) -> Placement:
    """Where the nodes of a description run; a process without nodes is not started."""
    from busflow.launchfile.description import ProcessSpec

    specs = {spec.name: spec for spec in description.processes}
    nodes: dict[str, list[str]] = {MAIN: []}
    taken = Counter([MAIN, *specs])
    for node in description.nodes:
        process = MAIN if node.process is None or spread is Spread.ONE else node.process
        if process == MAIN and spread is Spread.AUTO:
            process = node.name if not taken[node.name] else f"{node.name}-{taken[node.name]}"
            taken[node.name] += 1
            specs[process] = ProcessSpec(process, node.origin)
        nodes.setdefault(process, []).append(node.full_name)
    return Placement({process: tuple(names) for process, names in nodes.items()}, specs)


def idle_processes(descriptions: Sequence[LaunchDescription]) -> Iterator[Problem]:
    """Processes that no node is in: they are not started."""
    used = {node.process for description in descriptions for node in description.nodes}
    for description in descriptions:
        for spec in description.processes:
            if spec.name not in used:
                message = f"no node is in the process {spec.name}: it is not started"
                fix = f"write process: {spec.name} below a node"
                yield replace(problem_at("unused-process", message, fix, spec.origin), severity=Severity.WARNING)
