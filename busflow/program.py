"""Graphs in a Python program: `launch` in a running event loop, `run` as the whole program."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from busflow.errors import ExitCode, LaunchError, NotRunning, Problem
from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.placement import ProcessLayout, placed
from busflow.log import console_sink
from busflow.runner.assembly import Given, Kind, Role, Run
from busflow.runner.extension import Extension
from busflow.runner.graph import Graph, Wanted, What, described, is_simulated
from busflow.runner.loops.choice import LoopName
from busflow.runner.planning.machine import on_machine
from busflow.runner.source import variables_of
from busflow.runner.watchdog import BOUND_S


def launch(
    *what: What,
    args: Mapping[str, object] | None = None,
    seed: int | None = None,
    strict: bool = False,
    inspect: bool | str = False,
    watchdog: float | None = None,
    record: Wanted | None = None,
) -> Graph:
    """Create a graph of launch files, node classes and instances, for a program with its own event loop.

    The graph installs no signal handlers and logs to standard error. All nodes run in this process, even those that a
    launch file places in another one; the log says so.

        async with busflow.launch("configs/lab1.yaml", args={"rate_hz": 50}) as graph:
            async for state in graph.subscribe(Float64, "balance_state"):
                ...

    Args:
        what: launch files, descriptions, node classes and instances of the graph.
        args: the launch files' arguments.
        seed: the seed of the nodes' random generators, instead of the file's.
        strict: a subscription without a publisher is an error.
        inspect: let other terminals of this user inspect the graph, under this name if it is a string.
        watchdog: seconds for which a handler may block the event loop before the log names it.
        record: the file to record to, or the keys that replace a launch file's `record:`; False for none.

    Raises:
        LaunchError: with every problem of the launch files; on start, with every problem of the graph.
        RecordingRefused: on start, the file exists already, or cannot be created.
    """
    given = Given(
        args=args,
        seed=seed,
        strict=strict,
        sinks=(console_sink(sys.stderr, colour=False),),
        watchdog_s=watchdog,
        inspect=inspect,
        record=record,
    )
    graph = Run(what, Kind.LAUNCH, given).build()
    graph.attach(_PlacementNote(graph))
    return graph


def run(
    *what: What,
    args: Mapping[str, object] | None = None,
    seed: int | None = None,
    inspect: bool | str = True,
    watchdog: float | None = BOUND_S,
    record: Wanted | None = None,
    one_process: bool = False,
    machine: str | None = None,
    event_loop: LoopName = "busflow",
) -> ExitCode:
    """Run a graph as the whole program, until Ctrl-C, SIGTERM or a node's failure; return the exit code.

    On system time, and if the graph follows `/clock`, other terminals can inspect it, unless `inspect` is False; a
    string sets its name. There, too, the log names a handler that blocks the event loop for longer than `watchdog`
    seconds. The nodes of a launch file run in the processes it states; with `one_process`, and on simulated time, in
    one. If the file names machines, the nodes placed on `machine` run, or those placed on none. Each process has its
    own event loop: busflow's or, on real time, "uvloop" (an extra). A failure is printed on standard error, as by
    `busflow run`.

    Raises:
        LaunchError: the graph cannot run, or there is nothing to run.
        NotRunning: an event loop runs in this thread already, as in a notebook.
    """
    _check_that_it_can_run(what)
    given = Given(
        args=args,
        outer=dict(os.environ),
        seed=seed,
        sinks=(console_sink(sys.stderr, colour=False),),
        watchdog_s=watchdog,
        event_loop=event_loop,
        layout=ProcessLayout.ONE if one_process else ProcessLayout.FILE,
        inspect=inspect,
        record=record,
    )
    ready = [described(each, args) if isinstance(each, str | Path) else each for each in what]
    descriptions = [each for each in ready if isinstance(each, LaunchDescription)]
    with variables_of(descriptions):
        if not any(map(is_simulated, descriptions)):
            here = {id(each): on_machine(each, machine, together=one_process) for each in descriptions}
            ready = [here.get(id(each), each) for each in ready]
        with Run(ready, Kind.RUN, given) as whole:
            if whole.role is Role.MAIN:
                _check_that_it_can_be_spread(what, whole.descriptions, inspect)
            whole.build()
            return whole.go(lambda text: sys.stderr.write(f"error: {text}\n"))


def _check_that_it_can_run(what: Sequence[What]) -> None:
    """Refuse to run nothing, and to run a graph to its end inside of a running event loop.

    Raises:
        LaunchError: there is nothing to run.
        NotRunning: the message names the way out.
    """
    if not what:
        fix = 'give run() a launch file, or node classes: busflow.run("robot.yaml")'
        raise LaunchError([Problem("no-nodes", "there is nothing to run", fix)])
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        return
    raise NotRunning(
        "busflow.run(…) is a whole program, and an event loop runs here already, as in a notebook: write "
        "graph = await busflow.launch(…).start(), and at the end await graph.stop()"
    )


class _PlacementNote(Extension):
    """A log line if a launch file states several processes but all nodes run in one."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph

    def begin(self) -> None:
        """Write the line."""
        placements = map(placed, self._graph.descriptions)
        names = [process for each in placements for process in (*each.others, *each.elsewhere)]
        if names:
            text = "all nodes run in this process: busflow run, and busflow.run(FILE), start the others"
            self._graph.log.bind("busflow").info(text, processes=", ".join(names))


def _check_that_it_can_be_spread(
    what: Sequence[What], descriptions: Sequence[LaunchDescription], inspect: bool | str
) -> None:
    """Refuse arguments that cannot be passed on to other processes.

    Raises:
        LaunchError: the message says what to do instead.
    """
    spread = next(each for each in descriptions if placed(each).others or each.here is not None)
    place = spread.processes[0].origin.place if spread.processes else None
    problem = fix = ""
    if sum(isinstance(each, str | Path | LaunchDescription) for each in what) > 1:
        problem = f"{spread.name} is in several processes, which read one launch file, and there are others beside it"
        fix = "include the others in it"
    elif not any(isinstance(each, str | Path) for each in what):
        problem = f"{spread.name} is in several processes, which read its launch file, and here it was read before"
        fix = "give run() the file itself"
    elif inspect is False:
        problem = f"{spread.name} is in several processes, which look into each other: inspect=False is not possible"
        fix = "leave it out"
    if problem:
        raise LaunchError([Problem("processes", problem, f"{fix}; or run(…, one_process=True)", place)])
