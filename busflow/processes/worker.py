"""Worker: a process that the main process has started, as `python -m busflow.processes.worker NAME PIPE`."""

from __future__ import annotations

import asyncio
import faulthandler
import json
import os
import signal
import sys
import threading
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager, suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from busflow import timeouts
from busflow.errors import BusflowError, ExitCode, LaunchError, NodeFailed, ProcessFailed
from busflow.processes.assignment import Assignment, ParameterReports
from busflow.processes.pipe import PipeWriter
from busflow.runner.assembly import Feature, Given, Kind, Role, Run
from busflow.runner.extension import Extension
from busflow.runner.own_process import children, leave
from busflow.runner.run import run_graph
from busflow.wire.mirror.membership import Membership

if TYPE_CHECKING:
    from busflow.launchfile.model.description import LaunchDescription
    from busflow.recording.recorder.snapshot_share import SnapshotShare
    from busflow.runner.course import Course
    from busflow.runner.graph import Graph
    from busflow.wire.zenoh.network import Network

_COMMAND_BYTES = 1 << 16
_REPORT_S = 0.5
"""Time between reports to the main process; so the last report of a killed process is at most this old."""


def main(assignment: Assignment, pipe: int) -> ExitCode:
    """Run the nodes of an assignment until they end, or the main process ends them or ends itself.

    Args:
        assignment: the first line of standard input, where the main process's commands follow.
        pipe: the number of the pipe to the main process.
    """
    main_pipe = os.dup(0)
    # A process that a node starts must not read from the pipe, nor keep it open.
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    commands = _Commands(main_pipe)
    _adopt_settings(assignment)
    writer = PipeWriter(pipe)
    failures: list[str] = []
    graph: Graph | None = None
    code = ExitCode.FAILED
    try:
        _set_environment(assignment.outer)
        description = _description(assignment)
        _set_environment({**description.environment, **assignment.env})
        run = _run(description, assignment, writer, commands)
        graph = run.graph
        _set_niceness(graph, assignment.nice)
        code = run_graph(graph, loop_factory=run.loop_factory)
    except NodeFailed:
        failures = [failure.render() for failure in graph.failures] if graph is not None else []
    except BusflowError as error:
        code, failures = error.exit_code, [f"the process {assignment.process}: {error}"]
    finally:
        report = None if graph is None else _report_data(graph, writer)
        finished = graph is not None and bool(graph.supervisors) and graph.course.has_finished
        writer.send(report=report, end={"exit_code": int(code), "failures": failures, "finished": finished})
        writer.close()
    return code


def _description(assignment: Assignment) -> LaunchDescription:
    """Read what the main process has read.

    Raises:
        LaunchError: it has changed since, and has problems now.
    """
    description, problems = assignment.source.read()
    if description is None or problems:
        raise LaunchError(problems)
    return description


class _Commands:
    """Reads the main process's commands in a thread; when the main process has ended, ends this one too."""

    def __init__(self, main_pipe: int) -> None:
        self.snapshots: SnapshotShare | None = None
        """Writes the snapshots that the main process asks for; None if there are none to write."""
        self._course: Course | None = None
        self._code: ExitCode | None = None
        """The exit code of the run, once the main process has ended it."""
        self._main_pipe = main_pipe
        threading.Thread(target=self._read, name="busflow.main", daemon=True).start()

    def _read(self) -> None:
        with suppress(OSError), os.fdopen(self._main_pipe, "rb", buffering=0) as stream:
            while line := stream.readline(_COMMAND_BYTES):
                with suppress(ValueError, LookupError, TypeError):  # half a line: the main process was killed
                    command = json.loads(line)
                    if "end" in command:
                        self._code = ExitCode(command["end"])
                        self._ask_to_stop()
                        os.kill(os.getpid(), signal.SIGTERM)
                    elif self.snapshots is not None:
                        snapshot = command["snapshot"]
                        self.snapshots.write(Path(snapshot["path"]), snapshot["reason"], snapshot["lacking"])
        os.kill(os.getpid(), signal.SIGTERM)

    def stop(self, course: Course) -> None:
        """Stop a graph's course when the main process has ended the run, with the exit code of the run.

        So a recording's ledger has the end of the run, not of its share, which SIGTERM ends.
        """
        self._course = course
        self._ask_to_stop()

    def _ask_to_stop(self) -> None:
        if self._course is not None and self._code is not None:
            self._course.ask_to_stop_from_thread(self._code)


def _set_environment(variables: Mapping[str, str | None]) -> None:
    for name, value in variables.items():
        if value is None:
            os.environ.pop(name, None)
        else:
            os.environ[name] = value


def _adopt_settings(assignment: Assignment) -> None:
    """Give this process the main process's settings that matter to a node: module path, buffering of prints, faults."""
    timeouts.current = timeouts.Timeouts(**assignment.timeouts)
    sys.path[:] = assignment.path
    faulthandler.enable()
    for stream in (sys.stdout, sys.stderr):
        stream.reconfigure(line_buffering=True)  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType]  # they are pipes


def _run(description: LaunchDescription, assignment: Assignment, writer: PipeWriter, commands: _Commands) -> Run:
    """Build this process's part of the run; other nodes are neither imported nor built.

    Raises:
        LaunchError: a node that could be built in the main process cannot be built here.
    """
    part = replace(description, nodes=tuple(node for node in description.nodes if node.full_name in assignment.nodes))
    given = Given(
        seed=assignment.seed,
        log_level=assignment.log_level,
        sinks=(writer.log,),
        prints_failures=assignment.prints_failures,
        watchdog_s=assignment.watchdog_s,
        event_loop=assignment.event_loop,
    )
    own: dict[Feature, Callable[[Run], object]] = {
        Feature.LINK: lambda run: run.graph.attach(_Part(run.graph, assignment, writer)),
        Feature.RECORDER: lambda run: _record(run.graph, assignment.record, writer, commands),
    }
    run = Run([part], Kind.RUN, given, role=Role.WORKER, own=own)
    graph = run.build()
    commands.stop(graph.course)
    plan = graph.plan()
    if len(plan.nodes) != len(assignment.nodes):
        raise LaunchError(plan.errors)
    if assignment.restarts:
        plan.nodes = assignment.memory.restored(plan, graph.log)
        graph.course.hold(assignment.memory.stopped)
    graph.bus.observe(ParameterReports(lambda changes: writer.send(parameters=changes)))
    # The problems of this part are not those of the whole graph, which the main process has shown.
    plan.problems.clear()
    return run


def _record(graph: Graph, data: Mapping[str, Any] | None, writer: PipeWriter, commands: _Commands) -> None:
    """Record this process's share of the run, or keep its last moments, if there is a recording."""
    if data is None:
        return
    from busflow.recording.recorder.share import Share

    share = Share.of_json(data)
    if share.spec.snapshot is None:
        from busflow.recording.recorder.recorder import record_share

        record_share(graph, share)
        return
    from busflow.recording.recorder.snapshot_share import SnapshotShare

    commands.snapshots = SnapshotShare(
        graph,
        share,
        share.spec.snapshot,
        want=lambda reason: writer.send(snapshot={"wanted": reason}),
        on_report=lambda report: writer.send(snapshot={"report": asdict(report)}),
    )
    graph.attach(commands.snapshots)


def _set_niceness(graph: Graph, nice: int) -> None:
    """Set the process's niceness, as the launch file says."""
    if nice:
        try:
            os.nice(nice)
        except OSError as error:
            graph.log.bind("busflow").warning(f"nice: {nice} is not possible: {error.strerror}")


class _Part(Extension):
    """Joins this process to the run: its nodes wait for the other processes, and the main process gets reports."""

    def __init__(self, graph: Graph, assignment: Assignment, writer: PipeWriter) -> None:
        self._graph, self._writer, self._others = graph, writer, assignment.others
        self._membership = Membership(
            graph,
            Path(assignment.directory),
            assignment.card,
            process=assignment.process,
            socket=assignment.socket,
            earlier=assignment.earlier,
            network=_network(graph, assignment),
            about=lambda: {"restarts": assignment.restarts},
        )

    def begin(self) -> None:
        """Join the run."""
        self._membership.begin()

    @asynccontextmanager
    async def surround(self) -> AsyncGenerator[None]:
        """Wait for the others before the nodes start, and report until they have ended."""
        barrier = self._membership.barrier
        self._report()  # before the main process sees this one: it gets commands from the first report on
        barrier.begin()
        reporting = asyncio.create_task(self._report_again(), name="busflow.report")
        with self._graph.clock.wall_timeout(timeouts.current.processes_start):
            await barrier.passed(self._others, unless=self._graph.course.ending)
        yield
        reporting.cancel()

    def about(self) -> Mapping[str, Any]:
        """Return what this process knows of other sessions."""
        return self._membership.about()

    def order_carried_out(self) -> None:
        """Report at once: if this process is killed now, its next life must know which nodes stay stopped."""
        self._report()

    def end(self) -> None:
        """Leave the run."""
        self._membership.end()

    def _report(self) -> None:
        debugged = sys.gettrace() is not None or "pydevd" in sys.modules
        self._writer.send(report=_report_data(self._graph, self._writer), debugged=debugged)

    async def _report_again(self) -> None:
        while True:
            await self._graph.clock.sleep(_REPORT_S)
            self._report()


def _network(graph: Graph, assignment: Assignment) -> Network | None:
    """Return what this process has in common with nodes of ROS 2; they find it through their router."""
    if assignment.card.ros2_domain is None:
        return None
    from busflow.wire.zenoh.network import Network, Ros2Network

    topics = [pattern for each in graph.descriptions if each.ros2 for pattern in each.ros2.topics]
    listens, dials = (assignment.ros2_listens,), assignment.ros2_dials
    return Network((), ros2=Ros2Network(assignment.card.ros2_domain, topics, listens, dials))


def _report_data(graph: Graph, writer: PipeWriter) -> Mapping[str, Any]:
    """Return the report so far; its number of lost log lines includes those that the writer lost."""
    report = graph.report().as_json()
    return report | {"log_lines_lost": report["log_lines_lost"] + writer.lost}


def _run_as_program() -> None:
    before = children()
    try:
        code = main(Assignment.read(sys.stdin), int(sys.argv[-1]))
    except ProcessFailed as error:
        sys.exit(f"error: {error}")
    leave(code, before)
    sys.exit(code)


if __name__ == "__main__":
    _run_as_program()
