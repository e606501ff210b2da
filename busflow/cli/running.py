"""One run from the command line: its log, report, trace, tables and exit code."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import AbstractContextManager, closing, contextmanager, nullcontext
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.terminal.output import colour, json_text, outcome_printed, print_message
from busflow.cli.terminal.run_summary import print_summary
from busflow.dds import attach_bridge
from busflow.errors import ExitCode, IncompleteRecording, LaunchError, NodeFailed, ProgramFailed, Stray
from busflow.launchfile.model.description import ClockMode, LaunchDescription, RecordSpec
from busflow.launchfile.model.placement import ProcessLayout, placed
from busflow.launchfile.model.ros2 import Ros2Spec
from busflow.log import console_sink, json_sink
from busflow.programs import attach_programs
from busflow.ros2 import attach_successor, ros2_network
from busflow.runner.graph import Graph
from busflow.runner.loops.choice import chosen_loop
from busflow.runner.loops.system import LoopFactory
from busflow.runner.planning.machine import on_machine
from busflow.runner.run import run_graph
from busflow.runner.sources import is_simulated

if TYPE_CHECKING:
    from busflow.cli.options.launch_file import LaunchSource
    from busflow.processes.process_group import ProcessGroup
    from busflow.runner.report import Report


class Run:
    """A graph that is run from the command line."""

    def __init__(
        self,
        source: LaunchSource,
        *,
        layout: str,
        machine: str | None = None,
        sim: bool,
        seed: int | None,
        strict: bool,
        verbose: bool,
        log_format: str,
        record: str | None = None,
        record_topics: Sequence[str] = (),
        inspect: bool = True,
        name: str | None = None,
        watchdog_s: float | None = None,
        watch: bool = False,
        event_loop: str = "busflow",
        ros2: bool = False,
    ) -> None:
        """Prepare a run; its log goes to standard error, for people or as JSON."""
        # Standard error is None where the shell closed it: `2>&-`.
        stream = sys.stderr or Path(os.devnull).open("w")  # noqa: SIM115  # it lives as long as the process
        coloured = stream.isatty() if (wanted := colour()) is None else wanted
        sink = json_sink(stream) if log_format == "json" else console_sink(stream, colour=coloured)
        self._for_people = log_format != "json"
        level = "debug" if verbose else "info"
        self._options: dict[str, Any] = {"seed": seed, "strict": strict, "log_level": level, "sinks": (sink,)}
        self._options |= {"watchdog_s": watchdog_s, "prints_failures": self._for_people}
        self._outer = dict(os.environ)  # each process of the run reads the launch file with these variables
        self._source = source
        whole, together = source.description(), sim or ProcessLayout(layout) is ProcessLayout.ONE
        description = on_machine(whole, machine, together=together or is_simulated(whole))
        self._description = description = _with_ros2(description, ros2=ros2, sim=sim, inspect=inspect)
        self._name = name or description.name
        self._record = _record_spec(description.record, record, record_topics)
        self._simulated = sim or is_simulated(description)
        self._event_loop, self._new_loop = event_loop, chosen_loop(event_loop, simulated=self._simulated)
        # Simulated time needs one process: several have only the system's time in common.
        self._placement = placed(description, ProcessLayout.ONE if self._simulated else ProcessLayout(layout))
        self._group: ProcessGroup | None = None
        self._watch = watch
        if watch and not description.files:
            raise click.UsageError("--watch follows edits of FILE; with --plugin there is no FILE")
        if watch and self._simulated:
            raise click.UsageError("--watch follows edits in real time; run it without --watch on simulated time")
        self._spreads = bool(self._placement.others) or description.here is not None
        if watch and self._spreads:
            raise click.UsageError("--watch works only in one process: add --one-process")
        self._inspect: bool | str = name or True if inspect else False

    def go(self, for_s: float | None, report: Path | None, trace: Path | None = None) -> int:
        """Run the graph to its end, print its report, and return the exit code.

        Raises:
            LaunchError: The graph cannot run.
        """
        if self._spreads:
            self._refuse(trace is not None, "--trace", "a trace works only in one process")
            self._refuse(self._inspect is False, "--no-inspect", "the processes of a run inspect each other")
        _check_outputs(self._description.files, report, trace)
        with self._graph() as (graph, loop_factory), _traced(graph, trace) as traced:
            attach_programs(graph, [self._placement])
            if self._group is None and self._record is not None:  # a group has each of its processes record itself
                from busflow.recording.recorder.recorder import record_graph

                record_graph(graph, self._record)
            code = self._run(graph, for_s, loop_factory, report)
        outcome = self._outcome(graph)
        lost = [(traced and traced.error, trace), (_written(outcome, report), report)]
        code = code or (ExitCode.FAILED if any(error for error, _ in lost) else ExitCode.OK)
        with outcome_printed():
            print_summary(replace(outcome, exit_code=ExitCode(code)))
        for error, path in lost:
            if error is not None:
                print_message(f"error: cannot write the whole of {path}: {error.strerror}")
        return code

    def _graph(self) -> AbstractContextManager[tuple[Graph, LoopFactory]]:
        # Of the simulated runs, `simulated_graph` shows to other terminals only one that follows /clock: it lasts as
        # long as the publisher of /clock. Any other is over before they could look, and has to be the same every time.
        if self._spreads:
            return nullcontext((self._with_processes(), self._new_loop))
        if not self._simulated:
            graph = Graph([self._description], **self._options)
            if self._watch:
                from busflow.runner.live_edit import FileWatch

                graph.attach(FileWatch(graph, self._description, partial(self._source.read, self._outer)))
            self._show(graph)
            return nullcontext((graph, self._new_loop))
        from busflow.runner.simulation import simulated_graph

        show = None if self._inspect is False else self._show
        return simulated_graph([self._description], show=show, **self._options)

    def _show(self, graph: Graph) -> None:
        """Let other terminals inspect the graph, unless --no-inspect was given."""
        if self._inspect is not False:
            from busflow.wire.mirror.membership import inspectable

            inspectable(graph, self._inspect, network=ros2_network(graph.descriptions))
            attach_successor(graph)
            attach_bridge(graph)

    @staticmethod
    def _refuse(stated: bool, option: str, why: str) -> None:
        if stated:
            raise click.BadParameter(f"{why}; add --one-process", param_hint=option)

    def _with_processes(self) -> Graph:
        """Return the graph of this process, and create the group of the run's other processes."""
        from busflow.processes.process_group import ProcessGroup

        graph = Graph([self._description], **self._options)
        network = self._description.network if self._description.here is not None else None
        self._group = ProcessGroup(
            graph,
            self._placement,
            name=self._name,
            source=self._source,
            outer=self._outer,
            network=network,
            record=self._record,
            event_loop=self._event_loop,
        )
        attach_bridge(graph)
        return graph

    def _run(self, graph: Graph, for_s: float | None, loop_factory: LoopFactory, report: Path | None) -> int:
        def last_act(code: ExitCode) -> None:
            _written(replace(self._outcome(graph), exit_code=code), report)

        try:
            run_graph(graph, for_s=for_s, loop_factory=loop_factory, last_act=last_act)
        except NodeFailed:
            _print_errors(failure.render() for failure in graph.failures)
        except (IncompleteRecording, ProgramFailed, Stray) as error:
            _print_errors([str(error)])
        finally:
            if self._group:
                self._group.finish()
                _print_errors(self._group.failures)
        return graph.exit_code

    def _outcome(self, graph: Graph) -> Report:
        return self._group.run_report() if self._group else graph.report()


def _print_errors(texts: Iterable[str]) -> None:
    for text in texts:
        print_message(f"error: {text}")


def _with_ros2(description: LaunchDescription, *, ros2: bool, sim: bool, inspect: bool) -> LaunchDescription:
    """Return the description with nodes of ROS 2 let in, as it says, or with `--ros2` by the defaults."""
    simulated = sim or description.clock.mode is ClockMode.SIM
    if ros2 and simulated:
        raise click.UsageError("--ros2 needs real time: nodes of ROS 2 have no part in simulated time")
    if not inspect and not simulated and (ros2 or description.ros2 is not None):
        raise click.UsageError("nodes of ROS 2 take part by what --no-inspect leaves out: leave out one of both")
    if not ros2:
        return description
    if description.ros2 is None and description.here is not None:
        raise click.UsageError("with several machines FILE says it for all: network: {ros2: {domain: 0}}")
    return description if description.ros2 is not None else replace(description, ros2=Ros2Spec())


def _record_spec(stated: RecordSpec | None, file: str | None, topics: Sequence[str]) -> RecordSpec | None:
    """Return what to record: the launch file's section, overridden by the command line."""
    if file is None and topics and stated is None:
        raise click.UsageError("--record-topics says what goes into a recording; add --record FILE")
    if file is not None:
        stated = RecordSpec(file) if stated is None else replace(stated, to=file)
    return replace(stated, topics=tuple(topics)) if stated is not None and topics else stated


class _Lines:
    """A file that is written line by line while the graph runs; the first error ends the writing."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("w", encoding="utf-8", newline="\n")
        self.error: OSError | None = None
        """The first error, such as a full disk; it does not stop the graph."""

    def write(self, line: str) -> None:
        """Write a line, unless an error has occurred."""
        if self.error is None:
            self._attempt(lambda: self._file.write(line))

    def close(self) -> None:
        """Flush and close the file."""
        self._attempt(self._file.close)

    def _attempt(self, act: Callable[[], object]) -> None:
        try:
            act()
        except OSError as error:
            self.error = self.error or error


@contextmanager
def _traced(graph: Graph, path: Path | None) -> Generator[_Lines | None]:
    if path is None:
        yield None
        return
    from busflow.testing.trace import Trace

    new = not path.exists()
    try:
        with closing(_Lines(path)) as lines:
            Trace(graph, lines.write)
            yield lines
    except LaunchError:  # nothing ran, so there is nothing to trace
        if new:
            path.unlink()
        raise


def _written(outcome: Report, path: Path | None) -> OSError | None:
    """Write the report; return the error if that fails."""
    try:
        if path is not None:
            path.write_text(json_text(outcome.as_json()) + "\n", encoding="utf-8")
    except OSError as error:
        return error
    return None


def _check_outputs(files: Sequence[Path], report: Path | None, trace: Path | None) -> None:
    """Refuse a report or trace that cannot be written or would overwrite a file of the run, and both in one file."""
    for path, option in ((report, "--report"), (trace, "--trace")):
        if path and any(_same(path, each) for each in files):
            raise click.BadParameter(f"{path} is a file of this run: name another one", param_hint=option)
        if path:
            _check_writable(path, option)
    if report and trace and _same(report, trace) and (report.is_file() or not report.exists()):  # both may be /dev/null
        raise click.BadParameter(f"the report is written to {trace}: name another file", param_hint="--trace")


def _same(one: Path, other: Path) -> bool:
    try:
        return one.samefile(other)
    except OSError:  # one of them does not exist yet
        return one.resolve() == other.resolve()


def _check_writable(path: Path, option: str) -> None:
    """Check before the run that a file can be written; a run that is killed leaves none."""
    new = not path.exists()
    try:
        path.open("a", encoding="utf-8").close()
        if new:
            path.resolve().unlink()  # not a link to it
    except OSError as error:
        raise click.BadParameter(f"cannot write {path}: {error.strerror}", param_hint=option) from None
