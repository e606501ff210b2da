"""A graph and the program around it: `launch(...)` inside one that has an event loop, `run_graph` with signals."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Mapping
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import anyio

from busflow.errors import ExitCode
from busflow.launchfile.model.placement import placed
from busflow.log import console_sink
from busflow.runner.garbage import StepwiseCollection
from busflow.runner.graph import Graph
from busflow.runner.loops.system import LoopFactory, answers, new_event_loop
from busflow.runner.orphan_tasks import catch_strays, forgotten_awaits_told, lost_on
from busflow.runner.signals import SignalGuard
from busflow.runner.sources import What

if TYPE_CHECKING:
    from busflow.recording.recorder.options import Wanted


def launch(
    *what: What,
    args: Mapping[str, object] | None = None,
    seed: int | None = None,
    strict: bool = False,
    inspect: bool | str = False,
    watchdog: float | None = None,
    record: Wanted | None = None,
) -> Graph:
    """A graph of launch files, node classes and instances, for a program that has an event loop already.

    It installs no signal handlers and logs to standard error. All nodes run in this process, also those for which a
    launch file names another one: the log says so.

        async with busflow.launch("configs/lab1.yaml", args={"rate_hz": 50}) as graph:
            async for state in graph.subscribe(Float64, "balance_state"):
                ...

    Args:
        what: what the graph is made of.
        args: the launch files' arguments.
        seed: of the nodes' random generators, in place of the file's.
        strict: a subscription whose topic nobody publishes is an error.
        inspect: let other terminals of this user look into it, under this name if it is one.
        watchdog: seconds for which a handler may block the event loop before the log names it.
        record: the file to record to, or the keys of a launch file's `record:`, which it replaces; False for none.

    Raises:
        LaunchError: with every problem of the launch files; on start, with every problem of the graph.
        RecordingRefused: on start, the file is there already, or cannot be made.
    """
    sink = console_sink(sys.stderr, colour=False)
    graph = Graph(what, args=args, seed=seed, strict=strict, sinks=(sink,), embedded=True, watchdog_s=watchdog)
    graph.on_start.append(partial(_tell_of_processes, graph))
    return inspectable(recorded(graph, record), inspect)


def _tell_of_processes(graph: Graph) -> None:
    """Say that what a launch file puts into several processes is in one."""
    placements = map(placed, graph.descriptions)
    names = [process for each in placements for process in (*each.others, *each.elsewhere)]
    if names:
        told = "all nodes run in this process: busflow run, and busflow.run(FILE), start the others"
        graph.log.bind("busflow").info(told, processes=", ".join(names))


def recorded(graph: Graph, wanted: Wanted | None) -> Graph:
    """The graph, which is recorded as `wanted` says, or as its launch file does.

    Raises:
        InvalidParameter: these keys cannot be, with every reason.
        InvalidName: one of the patterns is none.
    """
    if wanted or (wanted is None and any(each.record for each in graph.descriptions)):
        from busflow.recording.recorder.recorder import record_graph

        record_graph(graph, wanted)
    return graph


def inspectable(graph: Graph, name: bool | str) -> Graph:
    """The graph, which other terminals of this user can look into while it runs, unless `name` is False.

    True stands for the launch file's name, or that of the program where there is none.
    """
    if name is False:
        return graph
    from busflow.wire.mirror.membership import inspect

    own = graph.name if graph.descriptions else Path(sys.argv[0]).stem or graph.name
    file = next((str(each.files[0].absolute()) for each in graph.descriptions), "")
    topics = [topic for each in graph.descriptions for topic in each.topics]
    history = {topic.topic: topic.history for topic in topics if topic.history is not None}
    inspect(graph, name=own if name is True else name, file=file, history=history)
    return graph


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
