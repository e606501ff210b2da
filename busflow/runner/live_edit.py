"""FileWatch: reads a launch file again when it is edited, and changes the running graph accordingly."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from busflow.errors import InvalidParameter, Problem, Severity
from busflow.launchfile.model.description import Examined, LaunchDescription
from busflow.launchfile.model.problems import log_problems
from busflow.node.parameters import Parameters, describe, value_of
from busflow.runner.extension import Extension
from busflow.runner.planning.planned_node import PlannedNode
from busflow.runner.planning.preflight import Plan, Preflight
from busflow.validation.faults import same

if TYPE_CHECKING:
    from busflow.runner.graph import Graph

POLL_S = 0.25
"""Interval of looks at the files, by the run's clock. What an editor does in several steps is over by the next look."""
MAX_BYTES = 1 << 21
"""Bytes of a file that are compared: a launch file with more is refused."""

Reader: TypeAlias = Callable[[], Examined]
"""Reads the launch file: what is right in it, and everything that is wrong."""
_Look: TypeAlias = dict[Path, object]


class FileWatch(Extension):
    """Watches the files of a launch description that runs."""

    def __init__(self, graph: Graph, description: LaunchDescription, read: Reader) -> None:
        """Create a watch, which begins when the graph starts and ends with it."""
        self._graph = graph
        self._description = description
        self._read = read
        self._log = graph.log.bind("busflow")
        self._times = _times(description.files)
        self._contents = _contents(description.files)
        self._stated: dict[str, _Stated] = {}
        self._task: asyncio.Task[None] | None = None

    def begin(self) -> None:
        """Begin to watch the files."""
        self._stated = _stated(self._graph.plan())
        self._task = asyncio.get_running_loop().create_task(self._live(), name="busflow.watch")
        self._task.add_done_callback(self._ended)

    def end(self) -> None:
        """Stop watching the files."""
        if self._task is not None:
            self._task.cancel()

    def _ended(self, task: asyncio.Task[None]) -> None:
        if not task.cancelled() and (error := task.exception()) is not None:
            self._log.error("the launch file is not watched any more", exc_info=error)

    async def _live(self) -> None:
        files = self._description.files
        self._log.debug("watches the launch file", files=len(files))
        while True:
            await self._graph.clock.sleep(POLL_S)
            if _times(files) == self._times:
                continue
            while (now := _times(files)) != self._times:  # until the editor has finished writing
                self._times = now
                await self._graph.clock.sleep(POLL_S)
            contents = await asyncio.to_thread(_contents, files)
            if contents == self._contents:
                continue
            files = await self._follow(files)
            # What is written while the graph follows is the next edit.
            self._times = {file: self._times.get(file) or look for file, look in _times(files).items()}
            self._contents = {file: contents.get(file) or look for file, look in _contents(files).items()}

    async def _follow(self, files: tuple[Path, ...]) -> tuple[Path, ...]:
        """Read the file again, change the graph accordingly if it is right; return the files to watch from now on."""
        new, problems = await asyncio.to_thread(self._read)
        if new is None or problems:
            self._refuse(problems)
            return files if new is None else tuple(dict.fromkeys([*files, *new.files]))
        plan = self._plan(new)
        if plan.errors:
            self._refuse(plan.errors)
            return new.files
        found = revision(self._description, self._stated, new, plan)
        self._description, self._stated = new, _stated(plan)
        log_problems(plan.problems, self._log, embedded=False)
        await apply(found, self._graph)
        self._log.info("follows the edited launch file", **(found.summary() or {"changed": "nothing that runs"}))
        if found.later:
            self._log.warning("this change needs a restart of the run", keys=", ".join(found.later))
        return new.files

    def _plan(self, description: LaunchDescription) -> Plan:
        """Plan the nodes of a description as this graph would build them; none is started."""
        graph = self._graph
        return Preflight(graph.clock, graph.log, seed=graph.seed, strict=graph.strict).plan([description])

    def _refuse(self, problems: Iterable[Problem]) -> None:
        for problem in problems:
            if problem.severity is Severity.ERROR:
                values = {key: str(at) for key, at in (("at", problem.place), ("fix", problem.fix)) if at}
                self._log.error(problem.message, **values)
        self._log.error("the edited launch file is refused; the run goes on as it was")


def _times(files: Iterable[Path]) -> _Look:
    """Return each file's time of change and its identity."""
    found: _Look = {}
    for file in files:
        try:
            status = file.stat()
        except OSError as error:
            found[file] = error.errno
        else:
            found[file] = (status.st_mtime_ns, status.st_size, status.st_ino)
    return found


def _contents(files: Iterable[Path]) -> _Look:
    """Return each file's content: a file written again without a change is no edit."""
    found: _Look = {}
    for file in files:
        try:
            with file.open("rb") as opened:
                found[file] = opened.read(MAX_BYTES)
        except OSError as error:
            found[file] = error.errno
    return found


_SAME = {key: key for key in ("name", "seed", "packages", "clock", "programs")}
_LATER = _SAME | {"environment": "env", "shutdown_grace_s": "shutdown"}
"""Settings that a run keeps as it began, with the keys of the launch file that state them."""


@dataclass(frozen=True, slots=True)
class Revision:
    """Differences between two descriptions of one graph."""

    parameters: Mapping[str, Mapping[str, object]]
    """Changed parameters by node that can be set while the node runs."""
    leaving: tuple[str, ...]
    """Nodes that the file no longer has."""
    coming: tuple[PlannedNode, ...]
    """Nodes that the file did not have before."""
    restarting: tuple[PlannedNode, ...]
    """Nodes of which something else is different."""
    later: tuple[str, ...]
    """Keys whose change takes effect only in another run."""

    def summary(self) -> dict[str, str]:
        """Describe the differences, for the log."""
        parts = {
            "set": [f"{node} {name}" for node, changes in self.parameters.items() for name in changes],
            "stopped": self.leaving,
            "started": [planned.runtime.full_name for planned in self.coming],
            "restarted": [planned.runtime.full_name for planned in self.restarting],
        }
        return {key: ", ".join(names) for key, names in parts.items() if names}


@dataclass(frozen=True, slots=True)
class _Stated:
    """Node as its launch file states it, read from an instance that has not been started."""

    shape: str
    """Everything of the node that cannot be changed while it runs."""
    parameters: Parameters
    """What it begins with; to set one while it runs is to have others."""


def _stated(plan: Plan) -> dict[str, _Stated]:
    """Return the nodes of a plan by name; the plan has not been started."""
    return {planned.runtime.full_name: _Stated(_shape(planned), planned.node.parameters) for planned in plan.nodes}


def revision(old: LaunchDescription, before: Mapping[str, _Stated], new: LaunchDescription, after: Plan) -> Revision:
    """Compare the former nodes with those of a new description, whose plan has not been started."""
    present = dict(before)
    changed: dict[str, Mapping[str, object]] = {}
    coming: list[PlannedNode] = []
    restarting: list[PlannedNode] = []
    for planned in after.nodes:
        former = present.pop(planned.runtime.full_name, None)
        if former is None:
            coming.append(planned)
            continue
        parameters: Parameters = planned.node.parameters
        changes = dict(_changes(former.parameters, parameters))
        read_only = {info.name for info in describe(type(parameters)) if info.read_only}
        if former.shape != _shape(planned) or read_only & changes.keys():
            restarting.append(planned)
        elif changes:
            changed[planned.runtime.full_name] = changes
    later = (key for name, key in _LATER.items() if getattr(old, name) != getattr(new, name))
    return Revision(changed, tuple(present), tuple(coming), tuple(restarting), tuple(later))


async def apply(revision: Revision, graph: Graph) -> None:
    """Change a running graph; what a node refuses is logged, and the rest is done all the same."""
    for name, changes in revision.parameters.items():
        try:
            graph.set_parameters(name, changes)
        except InvalidParameter as refused:
            graph.log.bind(name).error("the node refuses what its launch file says now", reason=str(refused))
    restarting = [planned.runtime.full_name for planned in revision.restarting]
    await graph.course.dismiss([*revision.leaving, *restarting])
    graph.course.admit([*revision.restarting, *revision.coming])


def _changes(before: Parameters, after: Parameters) -> Iterator[tuple[str, object]]:
    """Return the parameters whose values are different."""
    for info in describe(type(after)) if type(before) is type(after) else ():
        if not same(value_of(before, info.name), value_of(after, info.name)):
            yield info.name, value_of(after, info.name)


def _shape(planned: PlannedNode) -> str:
    """Return everything of a node that cannot be changed while it runs."""
    topics = [(end.topic, end.type, end.qos) for end in (*planned.publishers, *planned.subscriptions)]
    services = [(end.service, end.type) for end in (*planned.servers, *planned.clients)]
    spec = planned.spec
    kept = (spec.plugin, [(rule.match, rule.replacement) for rule in spec.remap]) if spec is not None else None
    return repr((type(planned.node), kept, planned.supervision, topics, services))
