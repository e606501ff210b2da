"""Gauges: ask a run for the measurements of some topics at an interval, and print them."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from math import ceil
from typing import TYPE_CHECKING, Any

import click

from busflow.cli.options.run import until_run_ends
from busflow.cli.terminal.field_paths import shape_of
from busflow.cli.terminal.output import print_line, print_message
from busflow.cli.topic.echoing import agreed_type, warn_if_unpublished
from busflow.cli.topic.rates import BW, DELAY, NOTHING, Flows, Measure, Reading, Window, drop_lines
from busflow.clock import sleep
from busflow.errors import ExitCode, InvalidInput, NoSuchTarget, Problem, RunEnded
from busflow.text import printable
from busflow.wire.client.known_type import known_type

if TYPE_CHECKING:
    from busflow.cli.options.waiting import Waiting
    from busflow.wire.client.client import Peer
    from busflow.wire.client.graph_view import GraphView, TopicView

_ASKED_EVERY_S = 1.0
"""The interval of questions: a run stops measuring for a reader that has not asked for five seconds."""


def gauge(
    peer: Peer,
    names: Sequence[str],
    measure: Measure,
    waiting: Waiting,
    *,
    window: int | None,
    count: int | None,
    every_s: float,
    as_json: bool,
) -> ExitCode:
    """Print a measurement of each topic, `count` times or until Ctrl-C or the run's end, also of the last interval.

    Raises:
        NoSuchTarget: There is no topic of one of the names in time.
        InvalidInput: A delay is to be measured, and the messages have no header.
        RunEnded: The run has ended.
        InspectionUnavailable: A handler blocks it.
    """
    graph, topics = waiting.until(lambda: _found(peer, names), NoSuchTarget)
    for topic in topics:
        if measure is DELAY:
            _require_header(peer, topic.name, agreed_type(topic, None))
        warn_if_unpublished(graph, topic)
    reader = f"{os.getpid()}-{os.urandom(6).hex()}"
    gauges = [_Gauge(peer, topic.name, reader, measure, window, named=len(topics) > 1) for topic in topics]
    if measure is BW and not as_json:
        click.echo("\n".join(printable(f"Subscribed to [{topic.name}]") for topic in topics))
    printed, steps = 0, ceil(every_s / _ASKED_EVERY_S)
    with until_run_ends(wants_more=count is not None):
        try:
            for each in gauges:
                each.ask()  # starts the meter
            while count is None or printed < count:
                for _ in range(steps):
                    sleep(every_s / steps)
                    for each in gauges:
                        each.ask()
                for each in gauges:
                    each.print_interval(as_json=as_json)
                printed += 1
        except (KeyboardInterrupt, RunEnded) as end:
            for each in gauges:
                if isinstance(end, KeyboardInterrupt):
                    each.ask()
                each.print_interval(as_json=as_json, last=True)
            raise
    return ExitCode.OK


def _found(peer: Peer, names: Sequence[str]) -> tuple[GraphView, list[TopicView]]:
    graph = peer.graph()
    return graph, [graph.topic(name) for name in names]


class _Gauge:
    """The measurement of one topic."""

    def __init__(
        self, peer: Peer, topic: str, reader: str, measure: Measure, window: int | None, *, named: bool
    ) -> None:
        self._peer, self._topic, self._reader, self._measure, self._named = peer, topic, reader, measure, named
        self._window = Window(window or measure.window)
        self._flows = Flows()
        self._since = NOTHING
        self._statistics: Sequence[Mapping[str, Any]] | None = None
        self._silent = False

    def ask(self) -> None:
        """Read the meters of the run's processes."""
        sizes = self._measure is BW
        answers = self._peer.ask("measure", topic=self._topic, reader=self._reader, sizes=sizes)
        self._since += Reading.of(answers)
        statistics = [line for answer in answers for line in answer["subscriptions"]]
        if self._statistics is None:
            self._flows.since(statistics)
        self._statistics = statistics

    def print_interval(self, *, as_json: bool, last: bool = False) -> None:
        """Print the interval that has ended, except the last if nothing was published in it."""
        since, self._since = self._since, NOTHING
        flows = self._flows.since(self._statistics or ())
        window = self._window.add(since)
        if last and not since.count:
            return
        if as_json:
            print_line(self._measure.as_json(self._topic, since, window, flows))
            return
        if not since.count:
            if not self._silent:
                print_message(f"{self._topic}: no new messages")
            self._silent = True
            return
        self._silent = False
        if not self._measure.spread(window).count:
            return
        if self._named:
            click.echo(printable(f"{self._topic}:"))
        click.echo(self._measure.text(window))
        for line in drop_lines(flows):
            click.echo(line)


def _require_header(peer: Peer, topic: str, type_name: str) -> None:
    shape = shape_of(known_type(peer, type_name))
    if shape is not None and "header" not in (shape.fields or {}):
        message = f"{topic} has messages of {type_name}, which have no header that says when they were made"
        raise InvalidInput(Problem("header", message, None))
