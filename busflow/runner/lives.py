"""Lives: the tasks in which the nodes of a graph run."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from busflow import timeouts

if TYPE_CHECKING:
    from busflow.runner.supervisor import Supervisor


class Lives:
    """One task for each node that runs; no task group, which could leave none behind."""

    def __init__(self, on_fault: Callable[[], None]) -> None:
        """Create it without tasks; `on_fault` is called when one ends in an error, which is a mistake in busflow."""
        self._on_fault = on_fault
        self._tasks: dict[Supervisor, asyncio.Task[None]] = {}

    def begin(self, supervisors: Sequence[Supervisor]) -> None:
        """Start to run these nodes."""
        for supervisor in supervisors:
            self._tasks[supervisor] = asyncio.get_running_loop().create_task(supervisor.live(), name=supervisor.name)
            self._tasks[supervisor].add_done_callback(partial(self._on_end, supervisor))

    async def has_left(self, supervisor: Supervisor) -> bool:
        """Return whether no code of an ended node runs any more; wait for it for a moment."""
        if supervisor in self._tasks:  # it has ended in this turn of the loop, or nothing ends it
            await asyncio.wait([self._tasks[supervisor]], timeout=timeouts.current.last_resort)
        return supervisor not in self._tasks

    def cancel(self) -> None:
        """Cancel all tasks."""
        for task in self._tasks.values():
            task.cancel()

    async def wait(self) -> None:
        """Wait until all nodes have ended, and raise the error of a task that ended in one."""
        for supervisor, task in tuple(self._tasks.items()):
            await supervisor.ended.wait()
            if task.done() and not task.cancelled():
                task.result()

    def _on_end(self, supervisor: Supervisor, task: asyncio.Task[None]) -> None:
        supervisor.ended.set()  # where it was cancelled before its first step
        if task.cancelled() or task.exception() is None:
            del self._tasks[supervisor]
        else:
            self._on_fault()
