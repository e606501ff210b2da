"""Merged report: one report of a run from the reports of its processes, those from before a restart included."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
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
    SubscriptionStatistics,
    TimerStatistics,
)
from busflow.launchfile.model.placement import MAIN
from busflow.runner.report import Blocks, NodeReport, ProcessReport, Report, ServiceReport, TopicReport

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
    lives = [[_LifeReport(main.nodes, main.topics, main.services, main.timers)]]
    inbox = Counter(dropped=main.inbox_dropped, refused=main.inbox_refused, lines=main.log_lines_lost)
    blocks = list(main.blocks)
    processes = [ProcessReport(name, None, tuple(node.name for node in main.nodes))]
    for worker in workers:
        lives.append([*(_read(each.report, ended=True) for each in worker.outcomes), _read(worker.report, ended=False)])
        for report in (*(each.report for each in worker.outcomes), worker.report):
            if report is not None:
                inbox.update(report["inbox"], lines=report["log_lines_lost"])
                blocks += [_as(Blocks, each) for each in report["blocks"]]
        failures = tuple(each.failure for each in worker.outcomes if each.failure)
        processes.append(
            ProcessReport(worker.name, worker.pid, worker.nodes, worker.restarts, worker.state.value, failures)
        )
    reports = [each for process in lives for each in process]
    nodes = {node.name: node for each in reports for node in each.nodes}
    nodes = {
        name: nodes.get(name) or NodeReport(name, "", "failed") for worker in workers for name in worker.nodes
    } | nodes
    return replace(
        main,
        nodes=tuple(nodes[name] for name in [*order, *(name for name in nodes if name not in order)] if name in nodes),
        topics=tuple(_with_unmatched(topic, lives) for topic in _topics(reports)),
        services=tuple(_services(reports)),
        timers=tuple(_timers(reports, order)),
        inbox_dropped=inbox["dropped"],
        inbox_refused=inbox["refused"],
        blocks=tuple(blocks),
        log_lines_lost=inbox["lines"],
        processes=tuple(processes),
    )


class _LifeReport:
    """Report of one life of a process: from one start to its end."""

    def __init__(
        self,
        nodes: Sequence[NodeReport] = (),
        topics: Sequence[TopicReport] = (),
        services: Sequence[ServiceReport] = (),
        timers: Sequence[TimerStatistics] = (),
    ) -> None:
        self.nodes, self.topics, self.services, self.timers = nodes, topics, services, timers


def _read(report: Mapping[str, Any] | None, *, ended: bool) -> _LifeReport:
    """Read a process's report. Messages that were queued in an ended process are counted as dropped."""
    if report is None:
        return _LifeReport()
    return _LifeReport(
        [_as(NodeReport, each) for each in report["nodes"]],
        [_topic(each, ended=ended) for each in report["topics"]],
        [
            _as(
                ServiceReport,
                each
                | {
                    "servers": tuple(_as(_server_kind(each), line) for line in each["servers"]),
                    "clients": tuple(_as(_client_kind(each), line) for line in each["clients"]),
                },
            )
            for each in report["services"]
        ],
        [_as(TimerStatistics, each) for each in report["timers"]],
    )


def _server_kind(service: Mapping[str, Any]) -> type[ServerStatistics]:
    return GoalServerStatistics if service["name"].endswith(SEND_GOAL) else ServerStatistics


def _client_kind(service: Mapping[str, Any]) -> type[ClientStatistics]:
    return GoalClientStatistics if service["name"].endswith(SEND_GOAL) else ClientStatistics


def _topic(report: Mapping[str, Any], *, ended: bool) -> TopicReport:
    lines: list[SubscriptionStatistics] = []
    for each in report["subscriptions"]:
        line = _as(SubscriptionStatistics, {**each, "topic": report["name"], "overflow": Overflow(each["overflow"])})
        if ended and line.queued:
            drops = {**line.drops, "process ended": line.drops.get("process ended", 0) + line.queued}
            line = replace(line, dropped=line.dropped + line.queued, queued=0, drops=drops)
        lines.append(line)
    return _as(TopicReport, {**report, "subscriptions": tuple(lines)})


def _as(cls: type[T], values: Mapping[str, Any]) -> T:
    known = {field.name for field in fields(cls)}  # pyright: ignore[reportArgumentType]  # all of them are dataclasses
    return cls(**{name: value for name, value in values.items() if name in known})


def _topics(reports: Iterable[_LifeReport]) -> Iterable[TopicReport]:
    """Merge topics: count a message as published in its publisher's process, and as received in a subscription's.

    Some published messages are in no report: those of a process just before it was killed, of another machine, or of a
    program outside of the run. Their count is that of the process that received most of them, which is a lower bound.
    """
    found: dict[str, TopicReport] = {}
    received = Counter[str]()
    for each in reports:
        for topic in each.topics:
            received[topic.name] = max(received[topic.name], topic.published)
            own = replace(topic, published=topic.published - topic.arrived, arrived=0)
            known = found.get(topic.name)
            if known is not None:
                own = replace(
                    known,
                    published=known.published + own.published,
                    since_s=min(known.since_s, own.since_s),
                    subscriptions=_lines(known.subscriptions, own.subscriptions),
                    losses=dict(Counter(known.losses) + Counter(own.losses)),
                )
            found[topic.name] = own
    return [replace(found[name], published=max(found[name].published, received[name])) for name in sorted(found)]


def _with_unmatched(topic: TopicReport, lives: Sequence[Sequence[_LifeReport]]) -> TopicReport:
    """Count a topic's messages that did not reach a subscription's process as drops of the subscription."""
    unmatched: dict[str, int] = {}
    for process in lives:
        known = [each for life in process for each in life.topics if each.name == topic.name]
        reached = sum(each.published + _undelivered(each) for each in known)
        unsent = _unsent(topic) - sum(map(_unsent, known))
        missed = max(0, topic.published - reached - unsent)
        unmatched |= {line.node: missed for each in known for line in each.subscriptions}
    lines = tuple(_with_drops(line, unmatched.get(line.node, 0)) for line in topic.subscriptions)
    return replace(topic, subscriptions=lines)


def _undelivered(topic: TopicReport) -> int:
    """Return how many published messages reached a process and not its nodes.

    Messages that an inbox dropped are left out: they were never published.
    """
    others = {INBOX_DROPPED, INBOX_REFUSED, *OUTGOING}
    return sum(count for reason, count in topic.losses.items() if reason not in others)


def _unsent(topic: TopicReport) -> int:
    """Return how many published messages did not leave their process."""
    return sum(topic.losses.get(reason, 0) for reason in OUTGOING)


def _with_drops(line: SubscriptionStatistics, count: int) -> SubscriptionStatistics:
    if not count:
        return line
    drops = {**line.drops, UNMATCHED: count}
    return replace(line, published=line.published + count, dropped=line.dropped + count, drops=drops)


def _lines(
    first: Sequence[SubscriptionStatistics], second: Sequence[SubscriptionStatistics]
) -> tuple[SubscriptionStatistics, ...]:
    """Add up the lines of each subscription over several lives of its process."""
    left = list(second)
    lines: list[SubscriptionStatistics] = []
    for line in first:
        same = next((each for each in left if (each.node, each.depth) == (line.node, line.depth)), None)
        if same is not None:
            left.remove(same)
            line = line + same  # noqa: PLW2901  # the line of all lives so far
        lines.append(line)
    return (*lines, *left)


def _services(reports: Iterable[_LifeReport]) -> Iterable[ServiceReport]:
    found: dict[str, ServiceReport] = {}
    for each in reports:
        for service in each.services:
            known = found.get(service.name, ServiceReport(service.name, service.type, (), ()))
            found[service.name] = replace(
                known,
                servers=_summed((*known.servers, *service.servers)),
                clients=_summed((*known.clients, *service.clients)),
            )
    return [found[name] for name in sorted(found)]


def _summed(lines: Sequence[T]) -> tuple[T, ...]:
    """Return one line for each node, which is the sum of its lines."""
    found: dict[str, Any] = {}
    for line in lines:
        node = line.node  # pyright: ignore[reportAttributeAccessIssue, reportUnknownMemberType, reportUnknownVariableType]  # both kinds of lines have one
        found[node] = line if node not in found else _sum(found[node], line)
    return tuple(found.values())


def _sum(first: Any, second: Any) -> Any:
    added: dict[str, Any] = {}
    left: Any
    right: Any
    for field in fields(first):
        left, right = getattr(first, field.name), getattr(second, field.name)
        if isinstance(left, dict):
            added[field.name] = dict(Counter[str](left) + Counter[str](right))  # pyright: ignore[reportUnknownArgumentType]  # by name
        elif isinstance(left, int) and field.name != "depth":
            added[field.name] = left + right
    return replace(first, **added)


def _timers(reports: Iterable[_LifeReport], order: Sequence[str]) -> Iterable[TimerStatistics]:
    """Merge timers, in the order of nodes: a timer of several lives is the last one, with the ticks of all."""
    found: dict[tuple[str, str], TimerStatistics] = {}
    for each in reports:
        for timer in each.timers:
            known = found.get((timer.node, timer.name))
            if known is not None:
                timer = replace(timer, fired=timer.fired + known.fired, missed=timer.missed + known.missed)  # noqa: PLW2901  # as above
            found[timer.node, timer.name] = timer
    place = {name: number for number, name in enumerate(order)}
    return sorted(found.values(), key=lambda timer: place.get(timer.node, len(place)))
