"""`Placement`: the process and machine of each node of a run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum

from busflow.errors import Problem, Severity
from busflow.launchfile.model.description import LaunchDescription, NodeSpec, ProcessSpec, ProgramSpec
from busflow.launchfile.model.problems import warning_at

MAIN = "main"
"""Name of the main process (`busflow run` itself), and of the machine that it is on without `--machine`."""
_ON = ":"


def process_name(machine: str, process: str) -> str:
    """Return the name of a process in the whole run.

    >>> process_name("main", "eyes"), process_name("arm", "eyes")
    ('eyes', 'arm:eyes')
    """
    return process if machine == MAIN else f"{machine}{_ON}{process}"


def machine_of(process: str) -> str:
    """Return the machine of a process, given its name in the whole run.

    >>> machine_of("eyes"), machine_of("arm:eyes")
    ('main', 'arm')
    """
    return process.partition(_ON)[0] if _ON in process else MAIN


class ProcessLayout(StrEnum):
    """Rule that puts nodes into processes."""

    FILE = "file"
    """Nodes are placed as the launch file says."""
    ONE = "one"
    """All nodes are in the main process."""
    AUTO = "auto"
    """Each in its own process, unless the file names one."""


@dataclass(frozen=True, slots=True)
class Placement:
    """Processes of a run on one machine with their nodes, and the nodes on other machines."""

    nodes: Mapping[str, tuple[str, ...]]
    """By process, the full names of its nodes; the main process first."""
    specs: Mapping[str, ProcessSpec]
    """By process, its settings in the launch file; the main process has none."""
    machine: str = MAIN
    elsewhere: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, tuple[str, ...]])
    """Processes of other machines, in the form of `nodes`."""
    programs: Mapping[str, tuple[ProgramSpec, ...]] = field(default_factory=dict[str, tuple[ProgramSpec, ...]])
    """By process, the programs that it starts: always the main process of a machine."""

    @property
    def main(self) -> str:
        """The main process of this machine."""
        return process_name(self.machine, MAIN)

    def process_of(self, node: str) -> str:
        """Return the process of a node; the main process for an unknown node."""
        everywhere = (*self.nodes.items(), *self.elsewhere.items())
        return next((process for process, nodes in everywhere if node in nodes), self.main)

    @property
    def others(self) -> tuple[str, ...]:
        """All processes of this machine but the main one."""
        return tuple(process for process in self.nodes if process != self.main)


def placed(description: LaunchDescription, layout: ProcessLayout = ProcessLayout.FILE) -> Placement:
    """Return the placement of a description's nodes. A process without nodes is not started."""
    here = description.here or MAIN
    stated = {process_name(spec.machine or MAIN, spec.name): spec for spec in description.processes}
    specs = {name: replace(spec, name=name) for name, spec in stated.items()}
    nodes: dict[str, list[str]] = {process_name(here, MAIN): []}
    elsewhere: dict[str, list[str]] = {}
    taken = Counter([MAIN, *(spec.name for spec in description.processes)])
    for node in description.nodes:
        machine = MAIN if node.machine is None or layout is ProcessLayout.ONE else node.machine
        process = MAIN if node.process is None or layout is ProcessLayout.ONE else node.process
        if process == MAIN and layout is ProcessLayout.AUTO:
            process = node.name if not taken[node.name] else f"{node.name}-{taken[node.name]}"
            taken[node.name] += 1
            specs[process_name(machine, process)] = _own_process(process_name(machine, process), node)
        where = nodes if machine == here or layout is ProcessLayout.ONE else elsewhere
        where.setdefault(process_name(machine, process), []).append(node.full_name)
    programs: dict[str, tuple[ProgramSpec, ...]] = {}
    for program in description.programs:
        machine = here if layout is ProcessLayout.ONE else program.machine or MAIN
        starter = process_name(machine, MAIN)
        programs[starter] = (*programs.get(starter, ()), program)
    return Placement(_frozen(nodes), specs, here, _frozen(elsewhere), programs)


def _own_process(name: str, node: NodeSpec) -> ProcessSpec:
    """Return the spec of a process made for one node; the launch file does not name it."""
    return ProcessSpec(name, node.origin, node.machine)


def _frozen(nodes: Mapping[str, Sequence[str]]) -> dict[str, tuple[str, ...]]:
    return {process: tuple(names) for process, names in nodes.items()}


def for_machine(here: str | None, spec: NodeSpec | ProgramSpec, problems: Sequence[Problem]) -> list[Problem]:
    """Return problems of a node or program, as warnings if it runs elsewhere: it need not be installed here."""
    where = spec.machine or MAIN
    if here in {None, where}:
        return list(problems)
    if isinstance(spec, NodeSpec):
        note = f"; {spec.full_name} runs on the machine {where}, and what it publishes is not checked here"
    else:
        note = f"; it runs on the machine {where}"
    return [replace(each, message=f"{each.message}{note}", severity=Severity.WARNING) for each in problems]


def unused_places(descriptions: Sequence[LaunchDescription]) -> Iterator[Problem]:
    """Report processes and machines without nodes: they are not started."""
    for description in descriptions:
        for name, machine in description.network.machines.items() if description.network else ():
            placed_here = [each for each in (*description.nodes, *description.programs) if each.machine == name]
            if name != MAIN and not placed_here:
                message, fix = f"no node is on the machine {name}", f"write machine: {name} below a node or a process"
                yield warning_at("unused-machine", message, fix, machine.origin)
    used = {node.process for description in descriptions for node in description.nodes}
    for description in descriptions:
        for spec in description.processes:
            if spec.name not in used:
                message = f"no node is in the process {spec.name}: it is not started"
                fix = f"write process: {spec.name} below a node"
                yield warning_at("unused-process", message, fix, spec.origin)
