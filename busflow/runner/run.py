"""Runs a graph as the whole program: signals, the event loop, and the collector's steps."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import closing
from functools import partial

import anyio

from busflow import timeouts
from busflow.errors import ExitCode
from busflow.runner.extension import Extension
from busflow.runner.garbage import StepwiseCollection
from busflow.runner.graph import Graph
from busflow.runner.loops.system import LoopFactory, answers, new_event_loop
from busflow.runner.orphan_tasks import OrphanTasks, unawaited_logged
from busflow.runner.signals import SignalGuard
from busflow.runner.supervisor import Supervisor


def run_graph(
    graph: Graph,
    *,
    for_s: float | None = None,
    loop_factory: LoopFactory = new_event_loop,
    last_act: Callable[[ExitCode], object] = lambda _code: None,
) -> ExitCode:
    """Run a graph with signals, for a time if one is given; once it has started, its garbage is collected in steps.

    A run that does not end is ended by force, after `last_act` with its exit code on another thread.

    Raises:
        LaunchError: the graph cannot run.
        NodeFailed: a node failed.
    """

    def ask_to_stop(code: ExitCode) -> None:
        leave_threads()
        graph.course.ask_to_stop_from_thread(code)

    leave_threads: Callable[[], object] = bool
    around_s = timeouts.current.around + graph.course.end_s
    guard = SignalGuard(ask_to_stop, grace_s=graph.grace_s + 0.1, around_s=around_s)
    guard.last_act, guard.report = last_act, graph.log.bind("busflow").warning
    with (
        guard,
        unawaited_logged(graph.log),
        closing(StepwiseCollection()) as collection,
        asyncio.Runner(loop_factory=loop_factory) as runner,
    ):
        graph.attach(_Program(graph, guard, collection, for_s))
        guard.goes_on = partial(_goes_on, graph, loop := runner.get_loop())
        leave_threads = getattr(loop, "leave_threads", bool)  # virtual time waits for threads
        orphans = OrphanTasks.of(loop) or OrphanTasks(loop)
        try:
            runner.run(_course(graph, guard, for_s))
        finally:  # what still works in threads of its own does not keep the program from ending
            guard.count_down(graph.exit_code)
    for orphan in orphans.end():
        graph.course.give_up(orphan)
    graph.check()
    return graph.exit_code


async def _course(graph: Graph, guard: SignalGuard, for_s: float | None) -> None:
    guard.precede_loop()
    await graph.start()
    if for_s is not None:
        with anyio.move_on_after(for_s):
            await graph.wait()
        await graph.clock.settle()
        await graph.stop()
    await graph.wait()


class _Program(Extension):
    """Extension that begins the limit of the run's time and the collection of garbage once the nodes have started."""

    def __init__(self, graph: Graph, guard: SignalGuard, collection: StepwiseCollection, limit_s: float | None) -> None:
        self._graph, self._guard, self._collection, self._limit_s = graph, guard, collection, limit_s
        self._started = False

    def nodes_started(self) -> None:
        """Count down, and leave out of the collection what is there now."""
        self._started = True
        if self._limit_s is not None and self._graph.clock.kind == "system":
            self._guard.end_after(self._limit_s)
        self._collection.begin()

    def node_rebuilt(self, supervisor: Supervisor) -> None:  # noqa: ARG002  # as Extension has it
        """Look also at what was there at the beginning: the former instance is garbage now.

        Where that is before all nodes have started, the run's time counts from the beginning: one may never start.
        """
        self._collection.unfreeze()
        if self._limit_s is not None and not self._started:
            left_s = max(0.0, self._limit_s - self._graph.clock.seconds())
            asyncio.get_running_loop().call_later(left_s, self._end_starting)

    def _end_starting(self) -> None:
        if not self._started:
            self._graph.ask_to_stop()


def _goes_on(graph: Graph, loop: asyncio.AbstractEventLoop) -> bool:
    """Return whether a run reaches its end: its nodes have ended, though the disk holds up the loop, or it is free."""
    return graph.course.has_finished or answers(loop) or graph.course.has_finished
