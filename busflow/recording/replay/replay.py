"""Replay: runs nodes again on a recording, and compares what they publish with what was recorded."""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from busflow import timeouts
from busflow.bus.endpoint import PARAMETER_EVENTS
from busflow.clock import NS_PER_S, Time
from busflow.errors import BagError, IncompleteRecording, LaunchError, NotRunning, ReplayDiffers
from busflow.interfaces.message import Message
from busflow.log import Log, LogRecord
from busflow.recording.bag.bag import Bag
from busflow.recording.recorder.ticks import TICKS
from busflow.recording.replay.comparison import Check, Difference
from busflow.recording.replay.history import Past, past_of
from busflow.recording.replay.nodes import OF_THE_RUN, replay_plan
from busflow.recording.replay.rerun import Rerun
from busflow.recording.replay.ticks import ComingTicks, ReplayClock
from busflow.recording.tools.message_diff import Comparison
from busflow.runner.assembly import Given, Kind, Run
from busflow.runner.graph import What
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.loops.virtual_test import run_virtual
from busflow.runner.planning.planned_node import PlannedNode
from busflow.runner.service_events import SUFFIX
from busflow.text import counted

TIME_TOLERANCE_S = 0.1
"""The tolerance of times, if the recorded run had the system's time."""
_SLACK_NS = NS_PER_S
"""The greatest distance of a tick recorded on the system's time from the grid that begins in the replay."""
_SHOWN = 5


@dataclass(slots=True)
class Replay:
    """The outcome of a replay."""

    recording: str
    nodes: tuple[str, ...]
    differences: list[Difference] = field(default_factory=list[Difference])
    """The first ones, in the order in which they were found."""
    difference_count: int = 0
    compared: dict[str, int] = field(default_factory=dict[str, int])
    """The number of compared pairs of messages, by topic."""
    outputs: dict[str, list[Message]] = field(default_factory=dict[str, list[Message]])
    """The messages that the nodes published in the replay, by topic."""
    log: list[LogRecord] = field(default_factory=list[LogRecord])
    """Every line that they logged."""
    notes: list[str] = field(default_factory=list[str])
    """The limits of the replay: what was not in the recording, or not compared."""

    @property
    def same(self) -> bool:
        """True if every recorded message was published again, and no other."""
        return self.difference_count == 0

    def assert_same(self) -> None:
        """Fail a test where it is not the same.

        Raises:
            ReplayDiffers: with the first differences.
        """
        if not self.same:
            raise ReplayDiffers(self.render())

    def render(self, most: int = _SHOWN) -> str:
        """Return the outcome in lines for people."""
        pairs = ", ".join(f"{count} on {topic}" for topic, count in sorted(self.compared.items())) or "nothing"
        names = ", ".join(self.nodes)
        outcome = "the same as in" if self.same else f"{counted(self.difference_count, 'difference')} from"
        lines = [f"{names}: {outcome} {self.recording}; compared: {pairs}"]
        lines += [f"  {each}" for each in self.differences[:most]]
        if self.difference_count > most:
            lines.append(f"  … and {self.difference_count - most} more")
        return "\n".join([*lines, *(f"  note: {each}" for each in self.notes)])

    def as_json(self) -> dict[str, Any]:
        """Return the outcome as plain data."""
        return {
            "recording": self.recording,
            "nodes": list(self.nodes),
            "same": self.same,
            "compared": self.compared,
            "difference_count": self.difference_count,
            "differences": [each.as_json() for each in self.differences],
            "notes": self.notes,
        }


def replay(
    recording: str | Path,
    *what: What,
    nodes: Collection[str] | str = (),
    args: Mapping[str, object] | None = None,
    tolerance: float = 0.0,
    time_tolerance_s: float | None = None,
    allow_incomplete: bool = False,
    keep: int | None = None,
    record: str | Path | None = None,
) -> Replay:
    """Run nodes anew on what was recorded, and compare what they publish with what was recorded.

        replay("run.mcap", SensorProcessor).assert_same()
        replay("run.mcap", "configs/lab1.yaml", nodes=["sensor_processor"]).assert_same()

    Args:
        recording: An MCAP file, or a bag of rosbag2.
        what: Launch files, node classes and instances.
        nodes: Which nodes of the launch files are run; all if none is named.
        args: Values of the launch files' arguments. A node's parameters are those that were recorded all the same.
        tolerance: How far floating-point numbers may be apart.
        time_tolerance_s: How far times may be apart, of publishing and in messages; by default 0 for a recording of
            simulated time, 0.1 s for one of the system's.
        allow_incomplete: Replay an incomplete recording too, as far as it goes.
        keep: How many messages of each topic `outputs` keeps, the newest; all by default.
        record: The file that the replay itself is recorded to.

    Raises:
        BagError: The recording cannot be read, or is of other types than the nodes.
        IncompleteRecording: It is incomplete.
        LaunchError: The nodes cannot run, with every problem.
    """
    try:
        asyncio.get_running_loop()
    except RuntimeError:
        pass
    else:
        raise NotRunning("replay(…) has an event loop of its own: call it in a plain def, not in an async def")
    names = [nodes] if isinstance(nodes, str) else list(nodes)
    with Bag(recording) as bag:
        _refuse_incomplete(bag, allow_incomplete)
        loop = VirtualLoop(thread_s=timeouts.current.run_thread, ends_handlers=False)
        comparison = _comparison(bag, tolerance, time_tolerance_s)
        main = _replay(bag, what, names, args, comparison, loop=loop, keep=keep, record=record, partly=allow_incomplete)
        outcome = run_virtual(main, name="replay", loop=loop)
        _refuse_incomplete(bag, allow_incomplete)
    return outcome


async def _replay(
    bag: Bag,
    what: tuple[What, ...],
    names: list[str],
    args: Mapping[str, object] | None,
    comparison: Comparison,
    *,
    loop: VirtualLoop,
    keep: int | None,
    record: str | Path | None,
    partly: bool,
) -> Replay:
    past = past_of(bag)
    clock = ReplayClock(loop, past.started_ns, slack_ns=0 if past.simulated else _SLACK_NS)
    log: list[LogRecord] = []
    replayed = replay_plan(what, names, past.parameters, args=args, clock=clock, log=Log(clock))
    given = Given(seed=past.seed, clock=clock, sinks=(log.append,), record=record)
    graph = Run(replayed.what, Kind.REPLAY, given).build()
    clock.start_at(Time(past.started_ns))  # where the launch file says otherwise
    plan = graph.plan()
    if plan.errors:
        raise LaunchError(plan.errors)
    nodes = tuple(each.runtime.full_name for each in plan.nodes)
    if not nodes:
        raise BagError("there is no node to run: name a launch file or node classes")
    _refuse_unrelated(bag, plan.nodes, past)
    if not partly:
        _refuse_picked(bag, plan.nodes)
    ending = None if past.simulated or bag.end_ns is None else bag.end_ns - comparison.time_tolerance_ns
    check = Check(comparison, started_ns=past.started_ns, forgiven_from_ns=ending)
    rerun = Rerun(graph, bag, past, check, clock=clock, others_publish=replayed.others_publish, keep=keep)
    with closing(ComingTicks(bag, nodes, past.ticks, in_order=past.ticks_in_order)) as coming:
        clock.expect(coming)
        await rerun.run()
    check.finish()
    if not any(check.compared.values()) and not check.count:
        published = ", ".join(sorted(check.compared)) or "nothing"
        raise BagError(
            f"there is nothing to compare: {', '.join(nodes)} publishes {published}, and neither the recording nor "
            "the replay has a message there"
        )
    outputs = {topic: list(messages) for topic, messages in rerun.outputs.items()}
    notes = [*replayed.notes, *_part_notes(bag), *rerun.notes]
    return Replay(str(bag.path), nodes, check.differences, check.count, dict(check.compared), outputs, log, notes)


def _comparison(bag: Bag, tolerance: float, time_tolerance_s: float | None) -> Comparison:
    simulated = bag.facts is not None and bag.facts.clock == "sim"
    if time_tolerance_s is None:
        time_tolerance_s = 0.0 if simulated else TIME_TOLERANCE_S
    return Comparison(tolerance, round(time_tolerance_s * NS_PER_S))


def _refuse_unrelated(bag: Bag, nodes: Sequence[PlannedNode], past: Past) -> None:
    """Refuse nodes of which nothing was recorded; a node that published nothing is known by its parameters."""
    names = {each.runtime.full_name for each in nodes}
    topics = {end.topic for each in nodes for end in (*each.publishers, *each.subscriptions)} - OF_THE_RUN
    services = {end.service + SUFFIX for each in nodes for end in (*each.servers, *each.clients)}
    known = {*past.parameters, *(node for node, _ in past.ticks)}
    if topics and not names & known and not (topics | services) & {each.topic for each in bag.channels}:
        raise BagError(
            f"{', '.join(sorted(names))} cannot be replayed on this recording, which has none of the topics: "
            f"{', '.join(sorted(topics))}"
        )


def _refuse_picked(bag: Bag, nodes: Sequence[PlannedNode]) -> None:
    """Refuse a part of a recording that was made without topics which these nodes need."""
    topics = {end.topic for each in nodes for end in (*each.publishers, *each.subscriptions)} - OF_THE_RUN
    topics |= {end.service + SUFFIX for each in nodes for end in (*each.servers, *each.clients)}
    topics |= {PARAMETER_EVENTS} | ({TICKS} if any(each.runtime.endpoints.timers for each in nodes) else set())
    for cut in bag.cuts:
        lacking = [each for each in cut.without if each in topics]
        if lacking:
            raise IncompleteRecording(
                f"{bag.path} is {cut}: a replay of these nodes needs {', '.join(lacking)}; convert it with these "
                "topics, or replay the whole; --incomplete, or allow_incomplete=True, replays what there is"
            )


def _part_notes(bag: Bag) -> Iterator[str]:
    """Yield a note for a part of a recording that begins later: the nodes lack, for example, their state."""
    for cut in (each for each in bag.cuts if each.from_ns is not None):
        yield (
            f"{bag.path.name} is {cut}: the nodes begin without the state and parameters that they had there; "
            f"for the same results replay {cut.of}"
        )


def _refuse_incomplete(bag: Bag, allowed: bool) -> None:
    if not allowed and bag.incomplete:
        raise IncompleteRecording(
            f"{bag.path} is not the whole of what happened: {'; '.join(bag.incomplete)}; --incomplete, or "
            "allow_incomplete=True, replays what there is"
        )
