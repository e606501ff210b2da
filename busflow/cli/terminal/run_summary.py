"""Tables at the end of a run: the ledger of every topic, the calls of services, and the lateness of timers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from busflow.actions.accounts import SERVER_COUNTS
from busflow.actions.names import action_of
from busflow.cli.terminal.table import Column, bare, print_table, print_text
from busflow.text import counted, printable

if TYPE_CHECKING:
    from busflow.bus.statistics import ServiceStatistics, TopicStatistics
    from busflow.runner.report import NodeReport, ProcessReport, RecordingReport, Report


def print_summary(report: Report) -> None:
    """Print the tables on standard output."""
    click.echo()
    ended = f"exit code {int(report.exit_code)}"
    print_text(
        f"{printable(report.name)}: {report.duration_s:.3f} s of {report.clock} time, seed {report.seed}, {ended}"
    )
    data = report.as_json()
    for rows, columns in (
        (list(topic_rows(data["topics"], report.duration_s)), TOPIC_COLUMNS),
        _services(report),
        (list(_actions(data["actions"])), _ACTION_COLUMNS),
        (list(_timers(report)), _TIMER_COLUMNS),
        (list(_programs(report)), _PROGRAM_COLUMNS),
    ):
        if rows:
            click.echo()
            print_table(rows, *columns)
    for remark in _remarks(report):
        click.echo()
        print_text(remark)


def _remarks(report: Report) -> Iterator[str]:
    """Yield a sentence for each restart, failure, block and loss, and for the recording."""
    for node in report.nodes:
        if node.parameters_set:
            yield f"{printable(node.name)}: parameters changed {_times(node.parameters_set)} while it ran"
        if node.restarts or node.failures:
            yield f"{printable(node.name)}: {_node_history(node)}"
        if node.stopped_by_hand or node.started_by_hand:
            yield f"{printable(node.name)}: {_by_hand(node)}"
    for block in report.blocks:
        yield (
            f"{printable(block.node)}: {printable(block.handler)} blocked the event loop {_times(block.count)}, "
            f"for {block.longest_s:.2f} s at the longest"
        )
    yield from (_process_history(process) for process in report.processes if process.restarts or process.fates)
    yield from (printable(program.fates[-1]) for program in report.programs if program.fates)
    for topic in report.topics:
        texts = [*_topic_losses(topic), *(() if report.processes else _away(topic))]
        yield from (f"{printable(topic.name)}: {text}" for text in texts)
    if report.recording is not None:
        yield _recording(report.recording)
    for snapshot in report.snapshots:
        yield snapshot_line(asdict(snapshot))


def _topic_losses(topic: TopicStatistics) -> Iterator[str]:
    """Yield a sentence for each way in which messages of a topic did not reach a subscription's queue."""
    # Here, because `topic stats` uses this module too, and shall not load what only a run needs.
    from busflow.bus.inbox import INBOX_DROPPED, INBOX_REFUSED
    from busflow.bus.statistics import EARLY, LOST, UNMATCHED, UNSENT, reasons_text

    gone = {reason: count for reason, count in topic.losses.items() if count}
    early, unsent = gone.pop(EARLY, 0), gone.pop(UNSENT, 0)
    threads = sum(gone.pop(reason, 0) for reason in (INBOX_DROPPED, INBOX_REFUSED))
    if gone:
        lost = {printable(each.node): reasons_text(each.lost) for each in topic.subscriptions if each.lost}
        at = "; ".join(f"{node}: {reasons}" for node, reasons in lost.items())
        readers = f" ({LOST} at {at})" if at else ""
        yield f"not all that came from other processes was received: {reasons_text(gone)}{readers}"
    if early:
        missed = counted(early, "message was", "messages were")
        yield f"{missed} published before other processes received the topic, and dropped"
    if unsent:
        missed = counted(unsent, "message was", "messages were")
        yield f"{missed} not sent to other processes: too large, or not encodable; the log says which"
    if threads:
        yield f"{counted(threads, 'message')} from other threads did not reach the topic: dropped before"
    for line in topic.subscriptions:
        if unmatched := line.drops.get(UNMATCHED):
            missed = counted(unmatched, "message")
            yield f"{missed} never reached {printable(line.node)}: it was not there, or its link lost them"


def _away(topic: TopicStatistics) -> Iterator[str]:
    """Yield a sentence for each subscription that was not there for all messages of its topic."""
    for line in topic.subscriptions:
        if (away := topic.published - line.published) > 0:
            missed = counted(away, "message was", "messages were")
            yield f"{missed} published before {printable(line.node)} had started or after it had stopped"


def ending(code: int) -> str:
    """Return the exit code of a program, or the name of the signal that ended it.

    >>> ending(3), ending(-9)
    ('3', 'SIGKILL')
    """
    from busflow.runner.signals import signal_name  # here, as above

    return str(code) if code >= 0 else signal_name(-code)


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"


def _node_history(node: NodeReport) -> str:
    """Return the failures and restarts of a node as text."""
    failed = f"failed {_times(node.failures)}" if node.failures else ""
    anew = f"was started anew {_times(node.restarts)}" if node.restarts else ""
    last = f"; the last time it {printable(node.last_failure, limit=200)}" if node.last_failure else ""
    return " and ".join(filter(None, [failed, anew])) + last


def _by_hand(node: NodeReport) -> str:
    """Return the stops and starts by hand of a node as text."""
    stopped = f"was stopped by hand {_times(node.stopped_by_hand)}" if node.stopped_by_hand else ""
    started = f"was started by hand {_times(node.started_by_hand)}" if node.started_by_hand else ""
    stayed = "; it stayed so" if node.state == "stopped by hand" else ""
    return " and ".join(filter(None, [stopped, started])) + stayed


def _process_history(process: ProcessReport) -> str:
    """Return the restarts and last end of a process that ended too early, as text."""
    anew = f" was started anew {_times(process.restarts)}" if process.restarts else ""
    last = f"; the last time {printable(process.fates[-1], limit=200)}" if process.fates else ""
    return f"process {printable(process.name)}{anew}{last}" if anew else printable(process.fates[-1])


TOPIC_COLUMNS = (
    Column("topic"),
    Column("type", short=bare, goes=1),
    Column("published", right=True),
    Column("rate", right=True, goes=2),
    Column("delivered", right=True),
    Column("dropped", right=True),
    Column("queued", right=True),
)


def topic_rows(topics: Sequence[Mapping[str, Any]], seconds: float, *, why: bool = False) -> Iterator[tuple[Any, ...]]:
    """Yield the rows of topics in a report's JSON and of their subscriptions; `why` adds the reasons of drops."""
    for topic in topics:
        length_s = seconds - topic.get("since_s", 0.0)
        rate = topic["published"] / length_s if length_s > 0 else 0.0
        yield topic["name"], topic["type"], topic["published"], f"{rate:.1f} Hz", "", "", ""
        for line in topic["subscriptions"]:
            drops = ", ".join(f"{count} {word}" for word, count in line["drops"].items()) if why else ""
            dropped = f"{line['dropped']} ({drops})" if drops else line["dropped"]
            if why and (lost := line.get("lost")):
                dropped = f"{dropped}, lost {', '.join(f'{count} {word}' for word, count in lost.items())}"
            queue = f"depth {line['depth']}, {line['overflow']}"
            yield f"  → {line['node']}", queue, line["published"], "", line["delivered"], dropped, line["queued"]


_CALLS = ("calls", "answered", "failed", "refused", "timed out", "withdrawn", "cancelled", "lost", "waiting")
"""The columns of a server or client: its calls, and their outcomes, which add up to the calls."""
_ALWAYS = {"calls", "answered", "failed", "waiting"}


def _services(report: Report) -> tuple[list[tuple[object, ...]], tuple[Column, ...]]:
    """Return rows and columns of the services that were called; the report has the other services too."""
    asked = [each for each in report.services if any(_received(each)) and action_of(each.name) is None]
    lines = [(each, [*_served(each), *_called(each)]) for each in asked]
    shown = [word for word in _CALLS if word in _ALWAYS or any(line[2].get(word) for _, all_ in lines for line in all_)]
    rows: list[tuple[object, ...]] = []
    for service, ends in lines:
        rows.append((service.name, service.type, *("" for _ in shown)))
        rows += [(node, depth, *(counts.get(word, "") for word in shown)) for node, depth, counts in ends]
    titles = (Column(word, right=True) for word in shown)
    return rows, (Column("service"), Column("type", short=bare, goes=1), *titles)


_ACTION_COLUMNS = (
    Column("action"),
    Column("type", short=bare, goes=1),
    Column("goals", right=True),
    *(Column(word, right=True) for word in SERVER_COUNTS),
    Column("left", right=True, goes=2),
    Column("lost", right=True, goes=2),
)


def _actions(actions: Sequence[Mapping[str, Any]]) -> Iterator[tuple[object, ...]]:
    """Yield the rows of the actions that were used, each with its servers and clients."""
    for action in actions:
        ends = [("←", each, each["received"]) for each in action["servers"]]
        ends += [("→", each, each["sent"]) for each in action["clients"]]
        if any(goals for _, _, goals in ends):
            yield action["name"], action["type"], *[""] * (len(_ACTION_COLUMNS) - 2)
            for arrow, each, goals in ends:
                counts = (each.get(word, "") for word in (*SERVER_COUNTS, "left", "lost"))
                yield f"  {arrow} {each['node']}", "", goals, *counts


def _received(service: ServiceStatistics) -> Iterator[int]:
    yield from (line.received for line in service.servers)
    yield from (line.called for line in service.clients)


def _served(service: ServiceStatistics) -> Iterator[tuple[str, str, dict[str, int]]]:
    for line in service.servers:
        counts = {
            "calls": line.received,
            "answered": line.served,
            "failed": line.failed,
            "refused": line.refused,
            "withdrawn": line.withdrawn,
            "lost": line.lost,
            "waiting": line.waiting,
        }
        yield f"  ← {line.node}", f"depth {line.depth}", counts


def _called(service: ServiceStatistics) -> Iterator[tuple[str, str, dict[str, int]]]:
    for line in service.clients:
        counts = {
            "calls": line.called,
            "answered": line.answered,
            "failed": line.failed - line.timed_out,
            "timed out": line.timed_out,
            "cancelled": line.cancelled,
            "waiting": line.waiting,
        }
        yield f"  → {line.node}", "", counts


def _recording(recording: RecordingReport) -> str:
    """Return a line that says whether the recording is complete."""
    shown = f"{printable(recording.path)}: {counted(recording.recorded, 'message')} recorded"
    if recording.complete:
        return f"{shown}, complete"
    return f"{shown}, INCOMPLETE, {recording.missed} missed: {printable(recording.why, limit=400)}"


def snapshot_line(found: Mapping[str, Any]) -> str:
    """Return a line about a snapshot, by its entry in the report: where it is, what it holds, and why it was made."""
    shown = f"{printable(found['path'])}: {counted(found['recorded'], 'message')} of {found['seconds']:.1f} s"
    state = "complete"
    if not found["complete"]:
        state = f"INCOMPLETE, {found['missed']} missed: {printable(found['why'], limit=400)}"
    return f"{shown}, {state} ({printable(found['reason'], limit=200)})"


_TIMER_COLUMNS = (
    Column("node"),
    Column("timer"),
    Column("period", right=True, goes=2),
    Column("fired", right=True),
    Column("missed", right=True),
    Column("late p50", right=True, goes=1),
    Column("late p99", right=True),
)


def _timers(report: Report) -> Iterator[tuple[object, ...]]:
    for timer in report.timers:
        late = (_milliseconds(timer.lateness_p50_s), _milliseconds(timer.lateness_p99_s))
        yield timer.node, timer.name, f"{timer.period_s:g} s", timer.fired, timer.missed, *late


_PROGRAM_COLUMNS = (
    Column("program"),
    Column("state"),
    Column("exit code", right=True),
    Column("restarts", right=True),
    Column("lines", right=True),
    Column("left out", right=True, goes=1),
)


def _programs(report: Report) -> Iterator[tuple[object, ...]]:
    for each in report.programs:
        code = ending(each.exit_codes[-1]) if each.exit_codes else ""
        yield each.name, each.state, code, each.restarts, each.lines, each.lines_left_out


def _milliseconds(seconds: float | None) -> str:
    return "" if seconds is None else f"{seconds * 1000:.2f} ms"
