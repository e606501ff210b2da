"""The tables at the end of a run: what became of every message, and how punctual the timers were."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from busflow.cli.output import colour
from busflow.recording.count import counted
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.report import NodeReport, ProcessReport, RecordingReport, Report

_WIDE = 200
"""Characters of a line where standard output is a file or a pipe: nothing is cut."""


def print_summary(report: Report) -> None:
    """Print the tables on standard output."""
    terminal = sys.stdout is not None and sys.stdout.isatty()  # pyright: ignore[reportUnnecessaryComparison]  # `>&-` closes it
    text = io.StringIO()
    console = Console(
        file=text,
        force_terminal=terminal if (wanted := colour()) is None else wanted,
        width=None if terminal else _WIDE,
        markup=False,
        highlight=False,
        emoji=False,
    )
    ended = f"exit code {int(report.exit_code)}"
    console.print(
        f"\n{printable(report.name)}: {report.duration_s:.3f} s of {report.clock} time, seed {report.seed}, {ended}"
    )
    for table in (_topics(report), _services(report), _timers(report)):
        if table.row_count:
            console.print()
            console.print(table)
    for remark in _remarks(report):
        console.print(f"\n{remark}")
    lines = (line.rstrip() for line in text.getvalue().splitlines())
    click.echo("\n".join(lines), color=True)  # rich has decided about colour already


def _remarks(report: Report) -> Iterator[str]:
    """What has to be said beside the tables."""
    for node in report.nodes:
        if node.parameters_set:
            yield f"{printable(node.name)}: parameters changed {_times(node.parameters_set)} while it ran"
        if node.restarts or node.failures:
            yield f"{printable(node.name)}: {_lives(node)}"
    for block in report.blocks:
        yield (
            f"{printable(block.node)}: {printable(block.handler)} blocked the event loop {_times(block.count)}, "
            f"for {block.longest_s:.2f} s at the longest"
        )
    for process in report.processes:
        if process.restarts or process.fates:
            yield _fortunes(process)
    for topic in report.topics:
        if gone := {reason: count for reason, count in topic.losses.items() if count}:
            reasons = ", ".join(f"{count} {reason}" for reason, count in gone.items())
            yield f"{printable(topic.name)}: not all that came from other processes was received: {reasons}"
    if lost := report.inbox_dropped + report.inbox_refused:
        yield f"{lost} messages from other threads were dropped before they reached their topic"
    if report.recording is not None:
        yield _recording(report.recording)


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _lives(node: NodeReport) -> str:
    """How a node that failed or was started anew fared."""
    failed = f"failed {_times(node.failures)}" if node.failures else ""
    anew = f"was started anew {_times(node.restarts)}" if node.restarts else ""
    last = f"; the last time it {printable(node.last_failure, limit=200)}" if node.last_failure else ""
    return " and ".join(filter(None, [failed, anew])) + last


def _fortunes(process: ProcessReport) -> str:
    """How a process that ended before its time fared."""
    anew = f" was started anew {_times(process.restarts)}" if process.restarts else ""
    last = f"; the last time {printable(process.fates[-1], limit=200)}" if process.fates else ""
    return f"process {printable(process.name)}{anew}{last}" if anew else printable(process.fates[-1])


def _topics(report: Report) -> Table:
    table = _table("topic", "type", "published", "rate", "delivered", "dropped", "queued")
    for topic in report.topics:
        rate = topic.published / report.duration_s if report.duration_s > 0 else 0.0
        _row(table, topic.name, topic.type, topic.published, f"{rate:.1f} Hz", "", "", "")
        for line in topic.subscriptions:
            queue = f"depth {line.depth}, {line.overflow}"
            _row(table, f"  → {line.node}", queue, line.published, "", line.delivered, line.dropped, line.queued)
    return table


def _services(report: Report) -> Table:
    """The services that were asked; the report has the others too."""
    table = _table("service", "type", "calls", "answered", "failed", "timed out", "waiting")
    for service in report.services:
        if not any(line.received for line in service.servers) and not any(line.called for line in service.clients):
            continue
        _row(table, service.name, service.type, "", "", "", "", "")
        for line in service.servers:
            failed = line.failed + line.refused + line.lost
            _row(table, f"  ← {line.node}", f"depth {line.depth}", line.received, line.served, failed, "", line.waiting)
        for line in service.clients:
            failed = line.failed - line.timed_out
            _row(table, f"  → {line.node}", "", line.called, line.answered, failed, line.timed_out, line.waiting)
    return table


def _recording(recording: RecordingReport) -> str:
    """Whether all is in the recording, in one line."""
    shown = f"{printable(recording.path)}: {counted(recording.recorded, 'message')} recorded"
    if recording.complete:
        return f"{shown}, complete"
    return f"{shown}, INCOMPLETE, {recording.missed} missed: {printable(recording.why, limit=400)}"


def _timers(report: Report) -> Table:
    table = _table("node", "timer", "period", "fired", "missed", "late p50", "late p99")
    for timer in report.timers:
        late = (_milliseconds(timer.lateness_p50_s), _milliseconds(timer.lateness_p99_s))
        _row(table, timer.node, timer.name, f"{timer.period_s:g} s", timer.fired, timer.missed, *late)
    return table


def _table(*titles: str) -> Table:
    """A table whose first two columns are text and the others numbers."""
    table = Table(box=None, pad_edge=False, header_style="bold")
    for index, title in enumerate(titles):
        table.add_column(title, justify="left" if index < 2 else "right", overflow="fold")
    return table


def _row(table: Table, *cells: object) -> None:
    table.add_row(*(Text(printable(cell)) for cell in cells))


def _milliseconds(seconds: float | None) -> str:
    return "" if seconds is None else f"{seconds * 1000:.2f} ms"
