"""Merged report: one report of a run from the reports of its processes, those from before a restart included."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, TypeVar

from busflow.actions.names import SEND_GOAL
from busflow.actions.statistics import GoalClientStatistics, GoalServerStatistics
from busflow.bus.inbox import INBOX_DROPPED, INBOX_REFUSED
from busflow.bus.qos import Overflow
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
)
from busflow.launchfile.model.placement import MAIN
from busflow.runner.report import Blocks, NodeReport, ProcessReport, Report

if TYPE_CHECKING:
    from busflow.processes.worker_process import WorkerProcess

T = TypeVar("T")


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
    services, timers = added(*(each.services for each in reports)), added(*(each.timers for each in reports))
    places = {name: number for number, name in enumerate(order)}
    return replace(
        main,
        nodes=tuple(sorted(nodes.values(), key=lambda node: places.get(node.name, len(places)))),
        topics=tuple(_with_unmatched(topic, lives) for topic in _topics(reports)),
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
        nodes=tuple(_as(NodeReport, each) for each in report["nodes"]),
        topics=tuple(_topic(each, ended=ended) for each in report["topics"]),
        services=tuple(map(_service, report["services"])),
        timers=tuple(_as(TimerStatistics, each) for each in report["timers"]),
        inbox_dropped=report["inbox"]["dropped"],
        inbox_refused=report["inbox"]["refused"],
        blocks=tuple(_as(Blocks, each) for each in report["blocks"]),
        log_lines_lost=report["log_lines_lost"],
    )


def _service(report: Mapping[str, Any]) -> ServiceStatistics:
    is_action = report["name"].endswith(SEND_GOAL)
    server, client = (GoalServerStatistics, GoalClientStatistics) if is_action else (ServerStatistics, ClientStatistics)
    return ServiceStatistics(
        report["name"],
        report["type"],
        tuple(_as(server, each) for each in report["servers"]),
        tuple(_as(client, each) for each in report["clients"]),
    )


def _topic(report: Mapping[str, Any], *, ended: bool) -> TopicStatistics:
    lines: list[SubscriptionStatistics] = []
    for each in report["subscriptions"]:
        line = _as(SubscriptionStatistics, {**each, "topic": report["name"], "overflow": Overflow(each["overflow"])})
        if ended and line.queued:
            drops = {**line.drops, "process ended": line.drops.get("process ended", 0) + line.queued}
            line = replace(line, dropped=line.dropped + line.queued, queued=0, drops=drops)
        lines.append(line)
    return _as(TopicStatistics, {**report, "topic": report["name"], "subscriptions": tuple(lines)})


def _as(cls: type[T], values: Mapping[str, Any]) -> T:
    known = {field.name for field in fields(cls)}  # pyright: ignore[reportArgumentType]  # all of them are dataclasses
    return cls(**{name: value for name, value in values.items() if name in known})


def _topics(reports: Iterable[Report]) -> Iterator[TopicStatistics]:
    """Merge topics: count a message as published in its publisher's process, and as received in a subscription's.

    Some published messages are in no report: those of a process just before it was killed, of another machine, or of a
    program outside of the run. Their count is that of the process that received most of them, which is a lower bound.
    """
    received = Counter[str]()
    own: list[list[TopicStatistics]] = []
    for each in reports:
        received |= Counter({topic.topic: topic.published for topic in each.topics})
        own.append([replace(topic, published=topic.published - topic.arrived, arrived=0) for topic in each.topics])
    for topic in sorted(added(*own), key=lambda topic: topic.topic):
        yield replace(topic, published=max(topic.published, received[topic.topic]))


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
