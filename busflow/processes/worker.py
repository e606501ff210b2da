"""Worker: runs the nodes of a process that the main process has started."""

from __future__ import annotations

import asyncio
import faulthandler
import gc
import json
import os
import signal
import sys
import threading
from collections.abc import AsyncGenerator, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow.errors import BusflowError, ExitCode, LaunchError, NodeFailed
from busflow.processes.assignment import Assignment, report_changes
from busflow.processes.pipe import PipeWriter
from busflow.runner.extension import Extension
from busflow.runner.graph import Graph
from busflow.runner.loops.choice import chosen_loop
from busflow.runner.run import run_graph
from busflow.wire.mirror.membership import Membership

if TYPE_CHECKING:
    from collections.abc import Callable

    from busflow.launchfile.model.description import LaunchDescription
    from busflow.recording.recorder.snapshot_share import SnapshotShare

_ORDER_BYTES = 1 << 16
_REPORT_S = 0.5
"""Time between reports to the main process; the last report of a killed process is no older."""
_PATIENCE_S = 60.0
"""How long to wait for the others; the main process decides about them long before."""


def work(describe: Callable[[Mapping[str, object]], LaunchDescription], pipe: int | None) -> ExitCode:
    """Run the nodes that standard input assigns, until they end, or the main process ends them or itself ends.

    Raises:
        ProcessFailed: nothing is assigned.
    """
    assignment = Assignment.read(sys.stdin if pipe is not None else None)
    leash = os.dup(0)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # what a node starts must not hold on to the pipe, nor read from it
    orders = _Orders(leash)
    _make_room(assignment)
    writer = PipeWriter(pipe or 0)
    failures: list[str] = []
    graph: Graph | None = None
    code = ExitCode.FAILED
    try:
        _set(assignment.outer)
        description = describe(assignment.args)
        _set(assignment.env)
        gc.freeze()  # what is imported by now is there to stay: to look through it all once more at the end takes long
        graph = _graph(description, assignment, writer, orders)
        _give_way(graph, assignment.nice)
        code = run_graph(graph, loop_factory=chosen_loop(assignment.event_loop))
    except NodeFailed:
        failures = [failure.render() for failure in graph.failures] if graph is not None else []
    except BusflowError as error:
        code, failures = error.exit_code, [f"the process {assignment.process}: {error}"]
    finally:
        report = None if graph is None else _figures(graph, writer)
        finished = graph is not None and bool(graph.units) and graph.has_finished
        writer.send(report=report, end={"exit_code": int(code), "failures": failures, "finished": finished})
        writer.close()
    return code


class _Orders:
    """Reads what the main process orders, in a thread, until that has ended, which ends this process too."""

    def __init__(self, leash: int) -> None:
        self.snapshots: SnapshotShare | None = None
        """Writes the snapshots that are ordered."""
        self.code: ExitCode | None = None
        """The exit code of the run, which the main process sends before the SIGTERM."""
        self._leash = leash
        threading.Thread(target=self._read, name="busflow.main", daemon=True).start()

    def _read(self) -> None:
        with suppress(OSError), os.fdopen(self._leash, "rb", buffering=0) as stream:
            while line := stream.readline(_ORDER_BYTES):
                with suppress(ValueError, LookupError, TypeError):  # half a line, of a main process that was killed
                    order = json.loads(line)
                    if "end" in order:
                        self.code = ExitCode(order["end"])
                    elif self.snapshots is not None:
                        order = order["snapshot"]
                        self.snapshots.order(Path(order["path"]), str(order["reason"]))
        os.kill(os.getpid(), signal.SIGTERM)


def _set(variables: Mapping[str, str | None]) -> None:
    for name, value in variables.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def _make_room(assignment: Assignment) -> None:
    """Set up this process like the main process, where it matters to a node."""
    sys.path[:] = assignment.path
    faulthandler.enable()
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(line_buffering=True)  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType]  # they are pipes


def _graph(description: LaunchDescription, assignment: Assignment, writer: PipeWriter, orders: _Orders) -> Graph:
    """Build this process's part of the graph; other nodes are neither imported nor built.

    Raises:
        LaunchError: a node can be built in the main process, and not here.
    """
    own = tuple(node for node in description.nodes if node.full_name in assignment.nodes)
    part = replace(description, nodes=own)
    graph = Graph(
        [part],
        seed=assignment.seed,
        log_level=assignment.log_level,
        sinks=(writer.log,),
        prints_failures=assignment.prints_failures,
        watchdog_s=assignment.watchdog_s,
    )
    graph.attach(_Part(graph, assignment, writer, orders))
    if assignment.record is not None:
        _record(graph, assignment.record, writer, orders)
    plan = graph.plan()
    if len(plan.members) != len(assignment.nodes):
        raise LaunchError(plan.errors)
    if assignment.restarts:
        plan.members = assignment.memory.restored(plan, graph.log)
        graph.held = frozenset(assignment.memory.stopped)
    report_changes(graph.bus, lambda changes: writer.send(parameters=changes))
    plan.problems.clear()  # problems of a whole graph are not those of a part, and the main process has shown them
    return graph


def _record(graph: Graph, words: Mapping[str, Any], writer: PipeWriter, orders: _Orders) -> None:
    """Record this process's share of the run, or keep its last moments."""
    from busflow.recording.recorder.share import Share

    share = Share.of_words(words)
    if share.spec.snapshot is None:
        from busflow.recording.recorder.recorder import record_share

        record_share(graph, share)
        return
    from busflow.recording.recorder.snapshot_share import SnapshotShare

    orders.snapshots = SnapshotShare(
        graph,
        share,
        share.spec.snapshot,
        want=lambda reason: writer.send(snapshot={"wanted": reason}),
        on_report=lambda report: writer.send(snapshot={"report": asdict(report)}),
    )
    graph.attach(orders.snapshots)


def _give_way(graph: Graph, nice: int) -> None:
    """Set the process's niceness, as the launch file says."""
    if nice:
        try:
            os.nice(nice)
        except OSError as error:
            graph.log.bind("busflow").warning(f"nice: {nice} is not possible: {error.strerror}")


class _Part(Extension):
    """Extension that joins this process to the run: nodes wait for other processes, and the main one gets reports."""

    def __init__(self, graph: Graph, assignment: Assignment, writer: PipeWriter, orders: _Orders) -> None:
        self._graph, self._writer, self._orders, self._others = graph, writer, orders, assignment.others
        self._membership = Membership(
            graph,
            Path(assignment.directory),
            assignment.card,
            process=assignment.process,
            socket=assignment.socket,
            about=lambda: {"restarts": assignment.restarts},
        )

    def begin(self) -> None:
        """Join the run."""
        self._membership.begin()

    @asynccontextmanager
    async def surround(self) -> AsyncGenerator[None]:
        """Wait for the others before the nodes start, and report until they have ended."""
        barrier = self._membership.barrier
        barrier.begin()
        reporting = asyncio.create_task(self._report(), name="busflow.report")
        with self._graph.clock.wall_timeout(_PATIENCE_S):
            await barrier.passed(self._others, unless=self._graph.ending)
        yield
        reporting.cancel()
        if self._graph.exit_code is ExitCode.TERMINATED and self._orders.code is not None:
            self._graph.exit_code = self._orders.code  # a recording's ledger has the end of the run, not of its share

    def end(self) -> None:
        """Leave the run."""
        self._membership.end()

    async def _report(self) -> None:
        while True:
            await self._graph.clock.sleep(_REPORT_S)
            debugged = sys.gettrace() is not None or "pydevd" in sys.modules
            self._writer.send(report=_figures(self._graph, self._writer), debugged=debugged)


def _figures(graph: Graph, writer: PipeWriter) -> Mapping[str, Any]:
    """Return the report so far, with the lines that the writer lost counted as lost by the log."""
    report = graph.report().as_json()
    return report | {"log_lines_lost": report["log_lines_lost"] + writer.lost}
