"""Merged report: one report of a run from the reports of its processes, those from before a restart included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
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
    reports = [each for process in lives for each in process]
    nodes = {name: NodeReport(name, "", "failed") for worker in workers for name in worker.nodes}
    nodes |= {node.name: node for each in reports for node in each.nodes}
    topics: dict[str, list[TopicStatistics]] = {}
    for topic in (topic for each in reports for topic in each.topics):
        topics.setdefault(topic.topic, []).append(topic)
    services, timers = added(*(each.services for each in reports)), added(*(each.timers for each in reports))
    places = {name: number for number, name in enumerate(order)}
    return replace(
        main,
        nodes=tuple(sorted(nodes.values(), key=lambda node: places.get(node.name, len(places)))),
        topics=tuple(_with_unmatched(TopicStatistics.of_run(topics[name]), lives) for name in sorted(topics)),
        services=tuple(sorted(services, key=lambda service: service.name)),
        timers=tuple(sorted(timers, key=lambda timer: places.get(timer.node, len(places)))),
        inbox_dropped=sum(each.inbox_dropped for each in reports),
        inbox_refused=sum(each.inbox_refused for each in reports),
        blocks=tuple(block for each in reports for block in each.blocks),
        log_lines_lost=sum(each.log_lines_lost for each in reports),
        processes=tuple(processes),
    )


def _read(main: Report, report: Mapping[str, Any], *, ended: bool) -> Report:
    """Read the report of one life of a process. Messages that were queued as it ended are counted as dropped."""
    return replace(
        main,
        nodes=tuple(from_json(NodeReport, each) for each in report["nodes"]),
        topics=tuple(_topic(each, ended=ended) for each in report["topics"]),
        services=tuple(map(_service, report["services"])),
        timers=tuple(from_json(TimerStatistics, each) for each in report["timers"]),
        inbox_dropped=report["inbox"]["dropped"],
        inbox_refused=report["inbox"]["refused"],
        blocks=tuple(from_json(Blocks, each) for each in report["blocks"]),
        log_lines_lost=report["log_lines_lost"],
    )


def _service(report: Mapping[str, Any]) -> ServiceStatistics:
    is_action = report["name"].endswith(SEND_GOAL)
    server, client = (GoalServerStatistics, GoalClientStatistics) if is_action else (ServerStatistics, ClientStatistics)
    return ServiceStatistics(
        report["name"],
        report["type"],
        tuple(from_json(server, each) for each in report["servers"]),
        tuple(from_json(client, each) for each in report["clients"]),
    )


def _topic(report: Mapping[str, Any], *, ended: bool) -> TopicStatistics:
    topic = TopicStatistics.from_json(report)
    return replace(topic, subscriptions=tuple(map(_ended, topic.subscriptions))) if ended else topic


def _ended(line: SubscriptionStatistics) -> SubscriptionStatistics:
    if not line.queued:
        return line
    drops = {**line.drops, "process ended": line.drops.get("process ended", 0) + line.queued}
    return replace(line, dropped=line.dropped + line.queued, queued=0, drops=drops)


def _with_unmatched(topic: TopicStatistics, lives: Sequence[Sequence[Report]]) -> TopicStatistics:
    """Count a topic's messages that did not reach a subscription's process as drops of the subscription."""
    unmatched: dict[str, int] = {}
    for process in lives:
        known = [each for life in process for each in life.topics if each.topic == topic.topic]
        reached = sum(each.published + _undelivered(each) for each in known)
        unsent = _unsent(topic) - sum(map(_unsent, known))
        missed = max(0, topic.published - reached - unsent)
        unmatched |= {line.node: missed for each in known for line in each.subscriptions}
    lines = tuple(_with_drops(line, unmatched.get(line.node, 0)) for line in topic.subscriptions)
    return replace(topic, subscriptions=lines)


def _undelivered(topic: TopicStatistics) -> int:
    """Return how many published messages reached a process and not its nodes.

    Messages that an inbox dropped are left out: they were never published.
    """
    others = {INBOX_DROPPED, INBOX_REFUSED, *OUTGOING}
    return sum(count for reason, count in topic.losses.items() if reason not in others)


def _unsent(topic: TopicStatistics) -> int:
    """Return how many published messages did not leave their process."""
    return sum(topic.losses.get(reason, 0) for reason in OUTGOING)


def _with_drops(line: SubscriptionStatistics, count: int) -> SubscriptionStatistics:
    if not count:
        return line
    drops = {**line.drops, UNMATCHED: count}
    return replace(line, published=line.published + count, dropped=line.dropped + count, drops=drops)
