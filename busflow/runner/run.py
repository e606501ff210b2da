"""Runs a graph as the whole program: signals, the event loop, and the collector's steps."""

from __future__ import annotations

import asyncio
from contextlib import closing
from functools import partial

import anyio

from busflow.errors import ExitCode
from busflow.runner.garbage import StepwiseCollection
from busflow.runner.graph import Graph
from busflow.runner.loops.system import LoopFactory, answers, new_event_loop
from busflow.runner.orphan_tasks import catch_strays, forgotten_awaits_told, lost_on
from busflow.runner.signals import SignalGuard


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
        guard.hear_first()
        await graph.start()
        collection.begin()
        if for_s is not None:
            with anyio.move_on_after(for_s):
                await graph.wait()
            await graph.clock.settle()
            await graph.stop()
        await graph.wait()

    guard = SignalGuard(graph.ask_to_stop_from_thread, grace_s=graph.grace_s + 0.1, around_s=graph.around_s)
    if for_s is not None and graph.clock.kind == "system":
        graph.on_ready = partial(guard.end_after, for_s)
    told = forgotten_awaits_told(graph.log)
    with guard, told, closing(StepwiseCollection()) as collection, asyncio.Runner(loop_factory=loop_factory) as runner:
        graph.on_restart.append(lambda _unit: collection.leave_nothing_out())
        guard.goes_on = partial(_goes_on, graph, loop := runner.get_loop())
        catch_strays(loop)
        try:
            runner.run(main())
        finally:  # what still works in threads of its own does not keep the program from ending
            guard.count_down(graph.exit_code)
    for lost in lost_on(loop):
        graph.give_up(lost)
    graph.check()
    return graph.exit_code


def _goes_on(graph: Graph, loop: asyncio.AbstractEventLoop) -> bool:
    """Whether a run gets to its end: its nodes are over, also while the disk holds up the loop, or the loop is free."""
    return graph.has_finished or answers(loop) or graph.has_finished
