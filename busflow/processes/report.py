"""Merged report: one report of a run from the reports of its processes, those from before a restart included."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from operator import attrgetter
from typing import TYPE_CHECKING, Any

from busflow.actions.names import SEND_GOAL
from busflow.actions.statistics import GoalClientStatistics, GoalServerStatistics
from busflow.bus.inbox import INBOX_DROPPED, INBOX_REFUSED
from busflow.bus.statistics import (
    OUTGOING,
    UNMATCHED,
    ClientStatistics,
    ServerStatistics,
    ServiceStatistics,
    SubscriptionStatistics,
    TimerStatistics,
    TopicStatistics,
    added,
    from_json,
)
from busflow.launchfile.model.placement import MAIN
from busflow.runner.report import Blocks, NodeReport, ProcessReport, Report

if TYPE_CHECKING:
    from busflow.processes.worker_process import WorkerProcess


@dataclass(frozen=True, slots=True)
class _Section:
    """A section that the report of each process has."""

    read: Callable[[Mapping[str, Any]], Any]
    """Returns the section, from the report of one process as plain data."""
    merged: Callable[[Sequence[Sequence[Any]]], Any]
    """Returns the section of the run, from the section by process, and there by life."""


def merged(main: Report, workers: Sequence[WorkerProcess], order: Sequence[str], *, name: str = MAIN) -> Report:
    """Merge the last reports of the other processes into that of the main process, once all have ended.

    A message that did not reach a subscription's process, in any of its lives, counts as a drop of the subscription.

    Args:
        main: the report of the main process.
        workers: the other processes.
        order: the full names of all nodes, in the order of the report.
        name: the name of the main process.
    """
    lives = [[main]]
    processes = [ProcessReport(name, None, tuple(node.name for node in main.nodes))]
    for worker in workers:
        ended = [_read(main, each.report, ended=True) for each in worker.outcomes if each.report is not None]
        lives.append(ended if worker.report is None else [*ended, _read(main, worker.report, ended=False)])
        failures = tuple(each.failure for each in worker.outcomes if each.failure)
        processes.append(
            ProcessReport(worker.name, worker.pid, worker.nodes, worker.restarts, worker.state.value, failures)
        )
    whole = {
        name: section.merged([[getattr(life, name) for life in process] for process in lives])
        for name, section in _SECTIONS.items()
    }
    nodes = {name: NodeReport(name, "", "failed") for worker in workers for name in worker.nodes}
    nodes |= {node.name: node for node in whole["nodes"]}
    places = {name: number for number, name in enumerate(order)}
    whole["nodes"] = tuple(sorted(nodes.values(), key=lambda node: places.get(node.name, len(places))))
    whole["timers"] = tuple(sorted(whole["timers"], key=lambda timer: places.get(timer.node, len(places))))
    return replace(main, **whole, sections={"processes": tuple(processes), **main.sections})


def _read(main: Report, report: Mapping[str, Any], *, ended: bool) -> Report:
    """Read the report of one life of a process. Messages that were queued as it ended are counted as dropped."""
    read = replace(main, **{name: section.read(report) for name, section in _SECTIONS.items()})
    return replace(read, topics=tuple(map(_ended, read.topics))) if ended else read


def _rows(name: str, read: Callable[[Mapping[str, Any]], Any]) -> Callable[[Mapping[str, Any]], Any]:
    return lambda report: tuple(map(read, report[name]))


def _service(report: Mapping[str, Any]) -> ServiceStatistics:
    is_action = report["name"].endswith(SEND_GOAL)
    server, client = (GoalServerStatistics, GoalClientStatistics) if is_action else (ServerStatistics, ClientStatistics)
    return ServiceStatistics(
        report["name"],
        report["type"],
        tuple(from_json(server, each) for each in report["servers"]),
        tuple(from_json(client, each) for each in report["clients"]),
    )


def _ended(topic: TopicStatistics) -> TopicStatistics:
    lines = (replace(_with_drops(line, "process ended", line.queued), queued=0) for line in topic.subscriptions)
    return replace(topic, subscriptions=tuple(lines))


def _joined(processes: Sequence[Sequence[Sequence[Any]]]) -> tuple[Any, ...]:
    return tuple(row for process in processes for life in process for row in life)


def _added(processes: Sequence[Sequence[Sequence[Any]]]) -> tuple[Any, ...]:
    return added(*(life for process in processes for life in process))


def _sum(processes: Sequence[Sequence[int]]) -> int:
    return sum(map(sum, processes))


def _balanced(processes: Sequence[Sequence[Sequence[TopicStatistics]]]) -> tuple[TopicStatistics, ...]:
    """Return the topics of the run, in the order of their names."""
    topics: dict[str, list[list[TopicStatistics]]] = {}
    for process in processes:
        for name, known in groupby(sorted(_joined([process]), key=_name), _name):
            topics.setdefault(name, []).append(list(known))
    return tuple(_with_unmatched(each) for _, each in sorted(topics.items()))


def _with_unmatched(processes: Sequence[Sequence[TopicStatistics]]) -> TopicStatistics:
    """Return a topic of the run; its subscriptions have dropped the messages that did not reach their processes."""
    topic = TopicStatistics.of_run(_joined([processes]))
    unmatched: dict[str, int] = {}
    for known in processes:
        reached = sum(each.published + _undelivered(each) for each in known)
        unsent = _unsent(topic) - sum(map(_unsent, known))
        missed = max(0, topic.published - reached - unsent)
        unmatched |= {line.node: missed for each in known for line in each.subscriptions}
    lines: list[SubscriptionStatistics] = []
    for line in topic.subscriptions:
        missed = unmatched.get(line.node, 0)
        lines.append(_with_drops(replace(line, published=line.published + missed), UNMATCHED, missed))
    return replace(topic, subscriptions=tuple(lines))


def _undelivered(topic: TopicStatistics) -> int:
    """Return how many published messages reached a process and not its nodes.

    Messages that an inbox dropped are left out: they were never published.
    """
    others = {INBOX_DROPPED, INBOX_REFUSED, *OUTGOING}
    return sum(count for reason, count in topic.losses.items() if reason not in others)


def _unsent(topic: TopicStatistics) -> int:
    """Return how many published messages did not leave their process."""
    return sum(topic.losses.get(reason, 0) for reason in OUTGOING)


def _with_drops(line: SubscriptionStatistics, reason: str, count: int) -> SubscriptionStatistics:
    if not count:
        return line
    return replace(line, dropped=line.dropped + count, drops={**line.drops, reason: line.drops.get(reason, 0) + count})


_name = attrgetter("name")
_SECTIONS = {
    "nodes": _Section(_rows("nodes", partial(from_json, NodeReport)), _joined),
    "topics": _Section(_rows("topics", TopicStatistics.from_json), _balanced),
    "services": _Section(_rows("services", _service), lambda every: tuple(sorted(_added(every), key=_name))),
    "timers": _Section(_rows("timers", partial(from_json, TimerStatistics)), _added),
    "inbox_dropped": _Section(lambda report: report["inbox"]["dropped"], _sum),
    "inbox_refused": _Section(lambda report: report["inbox"]["refused"], _sum),
    "blocks": _Section(_rows("blocks", partial(from_json, Blocks)), _joined),
    "log_lines_lost": _Section(lambda report: report["log_lines_lost"], _sum),
}
"""The sections that every process has, by name."""
