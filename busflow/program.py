"""A graph and the program around it: `launch(...)` inside one that has an event loop, `run(...)` as all there is."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Mapping
from pathlib import Path

import anyio

from busflow.errors import ExitCode, NodeFailed
from busflow.event_loop import LoopFactory, new_event_loop
from busflow.ingredients import What, described, is_simulated
from busflow.launchfile.description import LaunchDescription
from busflow.log import console_sink
from busflow.runner import Graph
from busflow.signals import SignalGuard
from busflow.watchdog import BOUND_S


def launch(
    *what: What,
    args: Mapping[str, object] | None = None,
    seed: int | None = None,
    strict: bool = False,
    inspect: bool | str = False,
    watchdog: float | None = None,
) -> Graph:
    """A graph of launch files, node classes and instances, for a program that has an event loop already.

    It installs no signal handlers and logs to standard error.

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

    Raises:
        LaunchError: with every problem of the launch files; on start, with every problem of the graph.
    """
    sink = console_sink(sys.stderr, colour=False)
    graph = Graph(what, args=args, seed=seed, strict=strict, sinks=(sink,), embedded=True, watchdog_s=watchdog)
    return inspectable(graph, inspect)


def run(
    *what: What,
    args: Mapping[str, object] | None = None,
    seed: int | None = None,
    inspect: bool | str = True,
    watchdog: float | None = BOUND_S,
) -> ExitCode:
    """Run a graph as the whole program, until Ctrl-C, SIGTERM or a node's failure; returns the exit code.

    On the system's time other terminals can look into it, under the name that `inspect` may give, unless it is False.
    There, too, the log names a handler that blocks the event loop for longer than `watchdog` seconds.
    A failure is told on standard error, as `busflow run` tells it.

    Raises:
        LaunchError: the graph cannot run.
    """
    ready = [described(each, args) if isinstance(each, str | Path) else each for each in what]
    sink = console_sink(sys.stderr, colour=False)
    if any(isinstance(each, LaunchDescription) and is_simulated(each) for each in ready):
        from busflow.testing.simulation import simulated_graph

        with simulated_graph(ready, seed=seed, sinks=(sink,)) as (graph, loop_factory):
            return _told(graph, loop_factory)
    return _told(inspectable(Graph(ready, seed=seed, sinks=(sink,), watchdog_s=watchdog), inspect), new_event_loop)


def _told(graph: Graph, loop_factory: LoopFactory) -> ExitCode:
    try:
        return run_graph(graph, loop_factory=loop_factory)
    except NodeFailed:
        for failure in graph.failures:
            sys.stderr.write(f"error: {failure.render()}\n")
        return graph.exit_code


def inspectable(graph: Graph, name: bool | str) -> Graph:
    """The graph, which other terminals of this user can look into while it runs, unless `name` is False.

    True stands for the launch file's name, or that of the program where there is none.
    """
    if name is False:
        return graph
    from busflow.wire.inspection import inspect

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
    """Run a graph with signals, for a time if one is given.

    Raises:
        LaunchError: the graph cannot run.
        NodeFailed: a node failed.
    """

    async def main() -> None:
        await graph.start()
        if for_s is not None:
            if graph.clock.kind == "system":
                guard.end_after(for_s)
            with anyio.move_on_after(for_s):
                await graph.wait()
            await graph.clock.settle()
            await graph.stop()
        await graph.wait()

    guard = SignalGuard(graph.ask_to_stop_from_thread, grace_s=graph.grace_s + graph.around_s + 0.1)
    with guard, asyncio.Runner(loop_factory=loop_factory) as runner:
        try:
            runner.run(main())
        finally:  # what still works in threads of its own does not keep the program from ending
            guard.count_down(graph.exit_code)
    return graph.exit_code
