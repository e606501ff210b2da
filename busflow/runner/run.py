"""Runs a graph as the whole program: signals, the event loop, and the collector's steps."""

from __future__ import annotations

import asyncio
from contextlib import closing
from functools import partial

import anyio

from busflow.errors import ExitCode
from busflow.runner.extension import Extension
from busflow.runner.garbage import StepwiseCollection
from busflow.runner.graph import Graph
from busflow.runner.loops.system import LoopFactory, answers, new_event_loop
from busflow.runner.orphan_tasks import OrphanTasks, orphans_left, unawaited_logged
from busflow.runner.signals import SignalGuard
from busflow.runner.supervisor import Unit


def run_graph(
    graph: Graph,
    *,
    for_s: float | None = None,
    loop_factory: LoopFactory = new_event_loop,
) -> ExitCode:
    """Run a graph with signals, for a time if one is given; once it has started, its garbage is collected in steps.

    Raises:
        LaunchError: the graph cannot run.
        NodeFailed: a node failed.
    """

    async def main() -> None:
        guard.precede_loop()
        await graph.start()
        if for_s is not None:
            with anyio.move_on_after(for_s):
                await graph.wait()
            await graph.clock.settle()
            await graph.stop()
        await graph.wait()

    guard = SignalGuard(graph.ask_to_stop_from_thread, grace_s=graph.grace_s + 0.1, around_s=graph.end_s)
    with (
        guard,
        unawaited_logged(graph.log),
        closing(StepwiseCollection()) as collection,
        asyncio.Runner(loop_factory=loop_factory) as runner,
    ):
        graph.attach(_Program(guard, collection, for_s if graph.clock.kind == "system" else None))
        guard.goes_on = partial(_goes_on, graph, loop := runner.get_loop())
        if OrphanTasks.of(loop) is None:
            OrphanTasks(loop)
        try:
            runner.run(main())
        finally:  # what still works in threads of its own does not keep the program from ending
            guard.count_down(graph.exit_code)
    for orphan in orphans_left(loop):
        graph.give_up(orphan)
    graph.check()
    return graph.exit_code


class _Program(Extension):
    """What begins once the nodes have started: the limit of the run's time, and the collection of its garbage."""

    def __init__(self, guard: SignalGuard, collection: StepwiseCollection, limit_s: float | None) -> None:
        self._guard, self._collection, self._limit_s = guard, collection, limit_s

    def nodes_started(self) -> None:
        """Count down, and leave out of the collection what is there now."""
        if self._limit_s is not None:
            self._guard.end_after(self._limit_s)
        self._collection.begin()

    def node_rebuilt(self, unit: Unit) -> None:  # noqa: ARG002  # as Extension has it
        """Look also at what was there at the beginning: the former instance is garbage now."""
        self._collection.leave_nothing_out()


def _goes_on(graph: Graph, loop: asyncio.AbstractEventLoop) -> bool:
    """Whether a run gets to its end: its nodes are over, also while the disk holds up the loop, or the loop is free."""
    return graph.has_finished or answers(loop) or graph.has_finished
