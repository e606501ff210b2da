"""One run from the command line: its log, report, trace, tables and exit code."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TextIO

import click

from busflow.cli.terminal.output import json_text, log_stream, outcome_printed, print_message
from busflow.cli.terminal.run_summary import print_summary
from busflow.errors import ExitCode, LaunchError
from busflow.launchfile.model.description import ClockMode, LaunchDescription, RecordSpec
from busflow.launchfile.model.placement import ProcessLayout
from busflow.launchfile.model.ros2 import Ros2Spec
from busflow.log import console_sink, json_sink
from busflow.runner.assembly import Given, Kind, Role, Run
from busflow.runner.graph import is_simulated
from busflow.runner.planning.machine import on_machine

if TYPE_CHECKING:
    from busflow.cli.options.launch_file import LaunchSource
    from busflow.runner.report import Report


def run_to_end(
    source: LaunchSource,
    *,
    machine: str | None,
    ros2: bool,
    for_s: float | None,
    report: Path | None,
    trace: Path | None,
    record: str | None,
    record_topics: Sequence[str],
    **options: Any,
) -> int:
    """Run a graph to its end with the options of `busflow run`, print its report, and return the exit code.

    Raises:
        LaunchError: The graph cannot run.
    """
    lines, given = _Lines(trace), _given(source, **options)
    whole, together = source.description(), given.simulated or given.layout is ProcessLayout.ONE
    description = on_machine(whole, machine, together=together or is_simulated(whole))
    description = _with_ros2(description, given, ros2=ros2)
    stated = _record_spec(description.record, record, record_topics)
    given = replace(given, record=stated, trace=lines.write if trace else None)
    with Run([description], Kind.RUN, given) as run:
        _refuse_options(run)
        _check_outputs(description.files, report, trace)
        with lines:
            run.build()
            code = run.go(
                lambda text: print_message(f"error: {text}"),
                for_s=for_s,
                last_act=lambda code: _written(replace(run.report(), exit_code=code), report),
            )
    outcome = run.report()
    lost = [(lines.error, trace), (_written(outcome, report), report)]
    code = code or (ExitCode.FAILED if any(error for error, _ in lost) else ExitCode.OK)
    with outcome_printed():
        print_summary(replace(outcome, exit_code=ExitCode(code)))
    for error, path in lost:
        if error is not None:
            print_message(f"error: cannot write the whole of {path}: {error.strerror}")
    return code


def _given(
    source: LaunchSource,
    *,
    verbose: bool,
    log_format: str,
    sim: bool,
    layout: str,
    inspect: bool,
    name: str | None,
    **options: Any,
) -> Given:
    """Return the options as a run takes them; its log goes to standard error, for people or as JSON."""
    for_people = log_format != "json"
    stream, coloured = log_stream()
    return Given(
        source=source,
        outer=dict(os.environ),  # each process of the run reads the launch file with these variables
        simulated=sim,
        log_level="debug" if verbose else "info",
        sinks=(console_sink(stream, colour=coloured) if for_people else json_sink(stream),),
        prints_failures=for_people,
        layout=ProcessLayout(layout),
        inspect=name or True if inspect else False,
        **options,
    )


def _refuse_options(run: Run) -> None:
    """Refuse options that the launch file's time or its processes do not allow."""
    spreads = run.role is Role.MAIN
    if run.given.watch:
        if not run.descriptions[0].files:
            raise click.UsageError("--watch follows edits of FILE; with --plugin there is no FILE")
        if run.simulated:
            raise click.UsageError("--watch follows edits in real time; run it without --watch on simulated time")
        if spreads:
            raise click.UsageError("--watch works only in one process: add --one-process")
    if spreads and run.given.trace is not None:
        raise click.BadParameter("a trace works only in one process; add --one-process", param_hint="--trace")
    if spreads and run.given.inspect is False:
        why = "the processes of a run inspect each other; add --one-process"
        raise click.BadParameter(why, param_hint="--no-inspect")


def _with_ros2(description: LaunchDescription, given: Given, *, ros2: bool) -> LaunchDescription:
    """Return the description with nodes of ROS 2 let in, as it says, or with `--ros2` by the defaults."""
    simulated = given.simulated or description.clock.mode is ClockMode.SIM
    if ros2 and simulated:
        raise click.UsageError("--ros2 needs real time: nodes of ROS 2 have no part in simulated time")
    if given.inspect is False and not simulated and (ros2 or description.ros2 is not None):
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
    """A file, if there is one, that is written line by line while a graph runs; the first error ends the writing."""

    def __init__(self, path: Path | None) -> None:
        self._path, self._new = path, path is not None and not path.exists()
        self._file: TextIO | None = None
        self.error: OSError | None = None
        """The first error, such as a full disk; it does not stop the graph."""

    def __enter__(self) -> Self:
        if self._path is not None:
            self._file = self._path.open("w", encoding="utf-8", newline="\n")
        return self

    def __exit__(self, kind: type[BaseException] | None, _error: object, _trace: object) -> None:
        if self._path is None or self._file is None:
            return
        self._attempt(self._file.close)
        if self._new and kind is not None and issubclass(kind, LaunchError):  # nothing ran: there is nothing to trace
            self._path.unlink()

    def write(self, line: str) -> None:
        """Write a line, unless an error has occurred."""
        if self.error is None and self._file is not None:
            self._attempt(partial(self._file.write, line))

    def _attempt(self, act: Callable[[], object]) -> None:
        try:
            act()
        except OSError as error:
            self.error = self.error or error


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
