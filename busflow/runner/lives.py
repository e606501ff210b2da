"""Lives: the tasks in which the nodes of a graph run."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from busflow.runner.units import RESORT_S

if TYPE_CHECKING:
    from busflow.runner.supervisor import Unit


class Lives:
    """One task for each node that runs; no task group, which could leave none behind."""

    def __init__(self, on_fault: Callable[[], None]) -> None:
        """Create it without tasks; `on_fault` is called when one ends in an error, which is a mistake in busflow."""
        self._on_fault = on_fault
        self._tasks: dict[Unit, asyncio.Task[None]] = {}

    def begin(self, units: Sequence[Unit]) -> None:
        """Start to run these nodes."""
        for unit in units:
            self._tasks[unit] = asyncio.get_running_loop().create_task(unit.live(), name=unit.name)
            self._tasks[unit].add_done_callback(partial(self._on_end, unit))

    async def has_left(self, unit: Unit) -> bool:
        """Return whether no code of an ended node runs any more; wait for it for a moment."""
        if unit in self._tasks:  # it has ended in this turn of the loop, or nothing ends it
            await asyncio.wait([self._tasks[unit]], timeout=RESORT_S)
        return unit not in self._tasks

    def cancel(self) -> None:
        """Cancel all tasks."""
        for task in self._tasks.values():
            task.cancel()

    async def wait(self) -> None:
        """Wait until all nodes have ended, and raise the error of a task that ended in one."""
        for unit, task in tuple(self._tasks.items()):
            await unit.ended.wait()
            if task.done() and not task.cancelled():
                task.result()

    def _on_end(self, unit: Unit, task: asyncio.Task[None]) -> None:
        unit.ended.set()  # where it was cancelled before its first step
        if task.cancelled() or task.exception() is None:
            del self._tasks[unit]
        else:
            self._on_fault()
