"""Expectations: a launch file's `expect:` section, checked on its nodes, on a run, and on runs with many seeds."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from math import inf
from typing import Any

import numpy as np

from busflow.bus.bus import BusObserver
from busflow.bus.subscription import Subscription
from busflow.bus.topic import Topic
from busflow.clock import NS_PER_S, Time
from busflow.errors import Deadlock, Fault, KeyPath, NodeFailed, Problem, Stray
from busflow.interfaces.message import Message, type_name
from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.keys import ExpectKeys, TopicExpectationKeys
from busflow.launchfile.model.problems import problems
from busflow.launchfile.yaml.value import Origin, StatedBy, Value
from busflow.log import LogRecord
from busflow.msgs.std_msgs import Header
from busflow.runner.assembly import Given, Kind, Run
from busflow.runner.graph import Graph
from busflow.runner.loops.virtual_test import run_virtual
from busflow.runner.planning.endpoints import NO_TOPICS
from busflow.runner.planning.preflight import PlannedNode
from busflow.runner.report import SnapshotReport
from busflow.text import counted, did_you_mean
from busflow.validation.annotations import at, split

_MOST_SNAPSHOTS = 10
"""The number of snapshots after which runs with further seeds keep nothing."""


@dataclass(slots=True)
class Trials:
    """Runs a launch file with one seed after another, and collects what was wrong."""

    description: LaunchDescription
    for_s: float
    seeds: list[int] = field(default_factory=list[int])
    """Seeds that were tried."""
    snapshots: list[SnapshotReport] = field(default_factory=list["SnapshotReport"])
    """Bags of the last moments before something went wrong, if the launch file asks for them."""
    _wrong: dict[str, tuple[Problem, list[int]]] = field(default_factory=dict[str, tuple[Problem, list[int]]])
    """Problems by subject: the first one, and all seeds that showed one."""

    def run(self, seeds: Iterable[int]) -> None:
        """Run once with each seed.

        Raises:
            LaunchError: The file cannot run.
        """
        for seed in seeds:
            self.seeds.append(seed)
            for key, problem in self._problems_with(seed):
                self._wrong.setdefault(key, (problem, []))[1].append(seed)

    def problems(self) -> list[Problem]:
        """Return the problems found, each with the first seed that shows it."""
        found: list[Problem] = []
        for problem, seeds in self._wrong.values():
            others = f", as with {counted(len(seeds) - 1, 'other')}" if len(seeds) > 1 else ""
            found.append(replace(problem, message=f"{problem.message} (seed {seeds[0]}{others}, of {len(self.seeds)})"))
        return found

    def _problems_with(self, seed: int) -> list[tuple[str, Problem]]:
        """Run with one seed; return what was wrong, each with its subject."""
        unhurried = replace(self.description, clock=replace(self.description.clock, rate=None))
        given = Given(seed=seed, simulated=True, record=None if len(self.snapshots) < _MOST_SNAPSHOTS else False)
        with Run([unhurried], Kind.TEST, given) as run:
            graph = run.build()
            expectations = Expectations(graph, expectations_of(self.description))
            try:
                return run_virtual(self._watched(graph, expectations), name="test", loop=run.virtual_loop)
            except (NodeFailed, Stray, Deadlock) as error:
                first, *more = str(error).splitlines()
                return [(first, Problem("failed-expectation", first, details=tuple(each[2:] for each in more)))]
            finally:
                self.snapshots += graph.report().snapshots

    async def _watched(self, graph: Graph, expectations: Expectations) -> list[tuple[str, Problem]]:
        """Run to the end; return what was wrong, of which something new is shown by a snapshot."""
        async with graph:
            await graph.clock.sleep(self.for_s)
            await graph.clock.settle()
        stated = self.description.expect or Value({}, Origin(StatedBy.FILE))
        found = {str(each.path): problems([each], stated, noun="expectation")[0] for each in expectations.broken()}
        new = [problem.message for key, problem in found.items() if key not in self._wrong]
        if new:
            for extension in graph.course.extensions:
                extension.snapshot("; ".join(new))
        return list(found.items())


def expectations_of(description: LaunchDescription) -> ExpectKeys:
    """Return the expectations of a launch file; empty ones where it states none."""
    return ExpectKeys() if description.expect is None else ExpectKeys.model_validate(description.expect.data)


def expectation_problems(description: LaunchDescription, nodes: Sequence[PlannedNode]) -> list[Problem]:
    """Find expectations of topics and fields that the launch file's nodes do not have."""
    if description.expect is None:
        return []
    types = {each.topic: each.type for planned in nodes for each in (*planned.publishers, *planned.subscriptions)}
    found: list[Fault] = []
    for topic, expected in expectations_of(description).topics.items():
        if topic not in types:
            text = f"no node publishes or receives the topic {topic}"
            found.append(Fault(("topics", topic), text, did_you_mean(topic, types, none=NO_TOPICS), "unknown"))
        else:
            found += _type_faults(topic, types[topic], expected)
    return problems(found, description.expect, noun="topic")


def _type_faults(topic: str, message_type: type[Message], expected: TopicExpectationKeys) -> Iterator[Fault]:
    if expected.max_age is not None and split(at(message_type, ("header",))[0])[0] is not Header:
        text = f"{topic} carries {type_name(message_type)}, which has no header, so its age is not known"
        yield Fault(("topics", topic, "max_age"), text, "leave it out")
    for name in expected.values:
        owner: object = message_type
        for step in name.split("."):
            fields = owner.model_fields if isinstance(owner, type) and issubclass(owner, Message) else {}
            if step not in fields:
                text = f"{type_name(message_type)} has no field {name}"
                fix = did_you_mean(step, fields, none=f"leave out {step}: what stands before it has no fields")
                yield Fault(("topics", topic, "values", name), text, fix, "unknown")
                break
            owner = split(fields[step].annotation)[0]


@dataclass(slots=True)
class _Seen:
    """Failures of one expectation: the text of the first, and their number."""

    wrong: int = 0
    first: str = ""

    def add(self, text: str) -> None:
        self.wrong += 1
        self.first = self.first or text

    def __str__(self) -> str:
        return self.first + (f", the first of {self.wrong} times" if self.wrong > 1 else "")


@dataclass(slots=True)
class Expectations(BusObserver):
    """Watches a graph, from before it starts to its end, for what its launch file expects."""

    graph: Graph
    expected: ExpectKeys
    _errors: _Seen = field(default_factory=_Seen)
    _ages: dict[str, _Seen] = field(default_factory=dict[str, _Seen])
    _values: dict[tuple[str, str], _Seen] = field(default_factory=dict[tuple[str, str], _Seen])

    def __post_init__(self) -> None:
        self.graph.bus.observe(self)
        self.graph.log.sinks.append(self._on_log)

    def broken(self) -> Iterator[Fault]:
        """Find the expectations that did not hold, each at its key of the `expect:` section."""
        report = self.graph.report()
        if self.expected.no_errors and self._errors.wrong:
            yield Fault(("no_errors",), f"the log has {counted(self._errors.wrong, 'error')}: {self._errors}")
        yield from self._drops((), self.expected.max_dropped, report.dropped, "")
        published = {topic.name: topic.published for topic in report.topics}
        dropped = {topic.name: sum(line.dropped for line in topic.subscriptions) for topic in report.topics}
        for topic, expected in self.expected.topics.items():
            path: KeyPath = ("topics", topic)
            rate_hz = published.get(topic, 0) / report.duration_s if report.duration_s > 0 else 0.0
            if not _within(rate_hz, expected.rate_hz):
                text = f"{topic} was published at {rate_hz:.6g} Hz, not {_shown(expected.rate_hz)}"
                yield Fault((*path, "rate_hz"), text)
            yield from self._drops(path, expected.max_dropped, dropped.get(topic, 0), f" on {topic}")
            if (ages := self._ages.get(topic)) is not None:
                yield Fault((*path, "max_age"), str(ages))
        for (topic, name), seen in self._values.items():
            yield Fault(("topics", topic, "values", name), str(seen))

    @staticmethod
    def _drops(path: KeyPath, most: int | None, dropped: int, where: str) -> Iterator[Fault]:
        if most is not None and dropped > most:
            yield Fault(
                (*path, "max_dropped"),
                f"{counted(dropped, 'message was', 'messages were')} dropped{where}, not at most {most}",
            )

    def _on_log(self, record: LogRecord) -> None:
        if record.level in {"error", "critical"}:
            self._errors.add(f"{record.node}: {record.event}")

    def topic_added(self, topic: Topic[Any]) -> None:
        """Check the values of a topic's messages."""
        expected = self.expected.topics.get(topic.name)
        if expected is not None and expected.values:
            self.graph.bus.tap(topic, partial(self._check_values, topic.name, expected))

    def subscription_added(self, subscription: Subscription[Any]) -> None:
        """Check the age of messages as a node gets them."""
        topic, node = subscription.topic, subscription.endpoint.node
        expected = self.expected.topics.get(topic)
        if expected is not None and expected.max_age is not None:
            subscription.observe(partial(self._check_age, topic, node, expected.max_age))

    def _check_age(self, topic: str, node: str, max_age_s: float, message: Any) -> None:
        age_s = (self.graph.clock.now() - Time.from_msg(message.header.stamp)).seconds
        if age_s > max_age_s:
            text = f"{topic} was {age_s:.6g} s old when {node} got it{self._when()}, not at most {max_age_s:.6g} s"
            self._ages.setdefault(topic, _Seen()).add(text)

    def _check_values(self, topic: str, expected: TopicExpectationKeys, message: Message) -> None:
        for name, limits in expected.values.items():
            value: Any = message
            for step in name.split("."):
                value = getattr(value, step)
            for number in np.ravel(value):
                if not _within(number, limits):
                    text = f"{name} of {topic} was {number}{self._when()}, not {_shown(limits)}"
                    self._values.setdefault((topic, name), _Seen()).add(text)
                    break

    def _when(self) -> str:
        return f" at {self.graph.clock.elapsed_ns() / NS_PER_S:.9g} s"


def _within(number: float, limits: list[float] | None) -> bool:
    """Return whether a number is within limits; NaN never is, unless there are none."""
    return limits is None or limits[0] <= number <= limits[1]


def _shown(limits: list[float] | None) -> str:
    lowest, highest = limits or (-inf, inf)
    if lowest == -inf:
        return f"at most {highest:.6g}"
    return f"at least {lowest:.6g}" if highest == inf else f"between {lowest:.6g} and {highest:.6g}"
