"""Supervisors of a graph's nodes: made, each with the others for which it waits, found, run, and stopped in order."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING

from busflow import timeouts
from busflow.bus.names import absolute_name
from busflow.clock import Clock, perf_counter
from busflow.errors import NotRunning
from busflow.node.node import Node
from busflow.node.supervision import stop_order
from busflow.runner.supervisor import Overseer, Supervisor
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.runner.extension import Extension
    from busflow.runner.planning.planned_node import PlannedNode
    from busflow.runner.restarting import Restarting


def supervisors_of(
    nodes: Sequence[PlannedNode],
    overseer: Overseer,
    extensions: Sequence[Extension] = (),
    beside: Sequence[Supervisor] = (),
) -> list[Supervisor]:
    """Make a supervisor for each node. It may wait for the others, those `beside`, and what the extensions have.

    A name that is found nowhere is that of a program that takes no part, as on simulated time: nothing waits for it.
    """
    supervisors = [Supervisor(each, overseer) for each in nodes]
    others = (each for extension in extensions for each in extension.prerequisites())
    by_name: dict[str, Restarting] = {each.name: each for each in (*others, *beside, *supervisors)}
    for supervisor in supervisors:
        supervisor.depend(by_name, supervisor.supervision.depends_on)
    return supervisors


def node_among(supervisors: Sequence[Supervisor], which: type[Node] | str) -> Node:
    """Return the node of a class, or of a name; relative names are below `/`.

    Raises:
        NotRunning: there is none, or more than one of the class.
    """
    if isinstance(which, str):
        full = absolute_name(which)
        found = [each.node for each in supervisors if each.name == full]
    else:
        found = [each.node for each in supervisors if isinstance(each.node, which)]
    shown = which if isinstance(which, str) else which.__name__
    names = [each.name for each in supervisors]
    if not found:
        raise NotRunning(f"there is no node {shown} in this graph; {did_you_mean(shown, names, none='it has none')}")
    if len(found) > 1:
        raise NotRunning(f"{len(found)} nodes are a {shown}; ask for one by name: {', '.join(names)}")
    return found[0]


async def stop_in_order(supervisors: Sequence[Supervisor], clock: Clock, grace_s: float) -> None:
    """Stop nodes, the last one first; none is given up before the grace of all has passed."""
    end = perf_counter() + grace_s
    by_name = {each.name: each for each in supervisors}
    order = stop_order(list(by_name), {each.name: each.supervision.depends_on for each in supervisors})
    for left, supervisor in zip(range(len(order), 0, -1), map(by_name.__getitem__, order), strict=True):
        ends_at_once = supervisor.ends_at_once
        supervisor.ask_to_stop()
        if ends_at_once:  # waiting takes turns of the loop, which are long where many nodes run
            continue
        # A slow node costs the others the order of stopping, not their own stop().
        with clock.wall_timeout((end - perf_counter()) / left):
            await supervisor.ended.wait()
    for supervisor in [each for each in supervisors if not each.ended.is_set()]:
        with clock.wall_timeout(end - perf_counter()):
            await supervisor.ended.wait()
    late = [each for each in supervisors if not each.ended.is_set()]
    for supervisor in late:
        supervisor.give_up(grace_s)
    for resort in (Supervisor.close_tasks, Supervisor.leave):
        with clock.wall_timeout(timeouts.current.last_resort):
            for supervisor in late:
                await supervisor.ended.wait()
        for supervisor in [each for each in late if not each.ended.is_set()]:
            resort(supervisor)


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
