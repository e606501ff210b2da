"""Graphs in a Python program: `launch` in a running event loop, `run` as the whole program."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow.dds import attach_bridge
from busflow.errors import (
    ExitCode,
    IncompleteRecording,
    LaunchError,
    NodeFailed,
    NotRunning,
    Problem,
    ProgramFailed,
    Stray,
)
from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.placement import ProcessLayout, placed
from busflow.log import console_sink
from busflow.programs import attach_programs
from busflow.runner.extension import Extension
from busflow.runner.graph import Graph
from busflow.runner.loops.choice import LoopName, chosen_loop
from busflow.runner.loops.system import LoopFactory
from busflow.runner.planning.machine import on_machine
from busflow.runner.run import run_graph
from busflow.runner.source import Source
from busflow.runner.sources import What, described, is_simulated
from busflow.runner.watchdog import BOUND_S

if TYPE_CHECKING:
    from busflow.processes.process_group import ProcessGroup
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
    sink = console_sink(sys.stderr, colour=False)
    graph = Graph(what, args=args, seed=seed, strict=strict, sinks=(sink,), embedded=True, watchdog_s=watchdog)
    graph.attach(_PlacementNote(graph))
    attach_programs(graph, [placed(each, ProcessLayout.ONE) for each in graph.descriptions])
    return _observed(graph, record, inspect)


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
    outer = dict(os.environ)
    ready = [described(each, args) if isinstance(each, str | Path) else each for each in what]
    descriptions = [each for each in ready if isinstance(each, LaunchDescription)]
    sink = console_sink(sys.stderr, colour=False)
    simulated = any(map(is_simulated, descriptions))
    new_loop = chosen_loop(event_loop, simulated=simulated)
    with _environment(descriptions):
        if simulated:
            from busflow.runner.simulation import simulated_graph

            show = None if inspect is False else partial(_observed, record=False, inspect=inspect)
            with simulated_graph(ready, show=show, seed=seed, sinks=(sink,)) as (graph, loop_factory):
                return _run_to_end(_observed(graph, record, inspect=False), loop_factory)
        ready = [
            on_machine(each, machine, together=one_process) if isinstance(each, LaunchDescription) else each
            for each in ready
        ]
        spread = [each for each in ready if isinstance(each, LaunchDescription) and _is_spread(each)]
        graph = Graph(ready, seed=seed, sinks=(sink,), watchdog_s=watchdog)
        if not spread or one_process:
            return _run_to_end(_observed(graph, record, inspect), new_loop)
        _check_that_it_can_be_spread(what, spread[0], inspect)
        group = _process_group(graph, spread[0], inspect, outer, args or {}, record, event_loop)
        return _run_to_end(graph, new_loop, group)


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


def _observed(graph: Graph, record: Wanted | None, inspect: bool | str) -> Graph:
    """Attach a recorder if `record` or the launch file asks for it, and inspection; return the graph.

    Raises:
        InvalidParameter: keys of the recording are invalid, with every reason.
        InvalidName: a pattern of topics is invalid.
    """
    if record or (record is None and any(each.record for each in graph.descriptions)):
        from busflow.recording.recorder.recorder import record_graph

        record_graph(graph, record)
    if inspect is not False:
        from busflow.ros2 import attach_successor, ros2_network
        from busflow.wire.mirror.membership import inspectable

        inspectable(graph, inspect, network=ros2_network(graph.descriptions))
        attach_successor(graph)
        attach_bridge(graph)
    return graph


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


def _process_group(
    graph: Graph,
    spread: LaunchDescription,
    name: bool | str,
    outer: Mapping[str, str],
    args: Mapping[str, object],
    record: Wanted | None,
    event_loop: LoopName,
) -> ProcessGroup:
    """Create the group of a graph's other processes, which end with it, and attach the bridge to DDS."""
    from busflow.processes.process_group import ProcessGroup  # this import needs Zenoh
    from busflow.recording.recorder.options import spec_of

    known_as = name if isinstance(name, str) else graph.name
    more: dict[str, Any] = {
        "network": spread.network if spread.here is not None else None,
        "record": spec_of(record, spread.record),
        "event_loop": event_loop,
    }
    group = ProcessGroup(
        graph, placed(spread), name=known_as, source=Source(spread.files[0], args=args), outer=outer, **more
    )
    attach_bridge(graph)
    return group


def _is_spread(description: LaunchDescription) -> bool:
    """Return whether more processes than this one run it, on this machine or on others."""
    return bool(placed(description).others) or description.here is not None


def _check_that_it_can_be_spread(what: Sequence[What], spread: LaunchDescription, inspect: bool | str) -> None:
    """Refuse arguments that cannot be passed on to other processes.

    Raises:
        LaunchError: the message says what to do instead.
    """
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


@contextmanager
def _environment(descriptions: Sequence[LaunchDescription]) -> Generator[None]:
    """Set the environment variables that launch files state, and restore the environment at the end."""
    stated = {name: value for each in descriptions for name, value in each.environment.items()}
    before = {name: os.environ.get(name) for name in stated}
    os.environ.update(stated)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name, None)
            if value is not None:
                os.environ[name] = value


def _run_to_end(graph: Graph, loop_factory: LoopFactory, group: ProcessGroup | None = None) -> ExitCode:
    layout = ProcessLayout.FILE if group else ProcessLayout.ONE
    attach_programs(graph, [placed(each, layout) for each in graph.descriptions])
    try:
        run_graph(graph, loop_factory=loop_factory)
    except NodeFailed:
        sys.stderr.writelines(f"error: {each.render()}\n" for each in graph.failures)
    except (IncompleteRecording, ProgramFailed, Stray) as error:
        sys.stderr.write(f"error: {error}\n")
    finally:
        if group:
            group.finish()
            sys.stderr.writelines(f"error: {text}\n" for text in group.failures)
    return graph.exit_code
