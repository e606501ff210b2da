"""Watch: reads a launch file again when it is edited, and has the running graph follow it."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from busflow.errors import Problem, Severity
from busflow.launchfile.check.preflight import Plan, Preflight
from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.problems import tell
from busflow.runner.revision import apply, revision

if TYPE_CHECKING:
    from busflow.runner.graph import Graph

POLL_S = 0.25
"""How often to look at the files, by the run's clock. What an editor does in several steps is over by the next look."""
MAX_BYTES = 1 << 21
"""More of a file need not be compared: one byte more than a launch file may have is refused."""

Reader: TypeAlias = Callable[[], tuple[LaunchDescription | None, tuple[Problem, ...]]]
"""Reads the launch file: what is right in it, and everything that is wrong."""
_Look: TypeAlias = dict[Path, object]


class Watch:
    """Watches the files of a launch description that runs."""

    def __init__(self, graph: Graph, description: LaunchDescription, read: Reader) -> None:
        """A watch that begins when the graph starts, and ends with it."""
        self._graph = graph
        self._description = description
        self._read = read
        self._log = graph.log.bind("busflow")
        self._times = _times(description.files)
        self._contents = _contents(description.files)
        self._task: asyncio.Task[None] | None = None
        graph.on_start.append(self._begin)
        graph.on_end.append(self._end)

    def _begin(self) -> None:
        self._task = asyncio.get_running_loop().create_task(self._live(), name="busflow.watch")
        self._task.add_done_callback(self._ended)

    def _end(self) -> None:
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
            while (now := _times(files)) != self._times:  # until whoever writes has finished
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
        """Read the file again, have the graph follow it if it is right, and return the files to watch from now on."""
        new, problems = await asyncio.to_thread(self._read)
        if new is None or problems:
            self._refuse(problems)
            return files if new is None else tuple(dict.fromkeys([*files, *new.files]))
        plan = self._plan(new)
        if plan.errors:
            self._refuse(plan.errors)
            return new.files
        found = revision(self._description, self._plan(self._description), new, plan)
        tell(plan.problems, self._log, embedded=False)
        await apply(found, self._graph)
        self._description = new
        self._log.info("follows the edited launch file", **(found.told() or {"changed": "nothing that runs"}))
        if found.later:
            self._log.warning("this change needs a restart of the run", keys=", ".join(found.later))
        return new.files

    def _plan(self, description: LaunchDescription) -> Plan:
        """The nodes of a description as this graph would have them, which nobody starts yet."""
        graph = self._graph
        return Preflight(graph.clock, graph.log, seed=graph.seed, strict=graph.strict).plan([description])

    def _refuse(self, problems: Iterable[Problem]) -> None:
        for problem in problems:
            if problem.severity is Severity.ERROR:
                values = {key: str(at) for key, at in (("at", problem.place), ("fix", problem.fix)) if at}
                self._log.error(problem.message, **values)
        self._log.error("the edited launch file is refused; the run goes on as it was")


def _times(files: Iterable[Path]) -> _Look:
    """When each file was written last, and as which file."""
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
    """What stands in each file: to write it anew, as it was, is no edit."""
    found: _Look = {}
    for file in files:
        try:
            with file.open("rb") as opened:
                found[file] = opened.read(MAX_BYTES)
        except OSError as error:
            found[file] = error.errno
    return found
