"""Facts of a recording that a replay needs beforehand: parameters, timers, lost messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from busflow.bus.endpoint import PARAMETER_EVENTS
from busflow.bus.statistics import UNMATCHED
from busflow.errors import BagError, MalformedMessage
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.std_msgs import String
from busflow.node.parameter_messages import plain_value
from busflow.recording.bag.facts import mappings
from busflow.recording.recorder.ticks import TICKS, Tick
from busflow.runner.service_events import SUFFIX
from busflow.text import counted

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag
    from busflow.recording.bag.channel import Channel, Entry


def loss_notes(bag: Bag, topics: Collection[str], nodes: Collection[str]) -> Iterator[str]:
    """A line for each topic of the nodes whose recorded messages are not those that they had.

    Args:
        bag: The recording, whose ledger is asked.
        topics: What the nodes publish and receive.
        nodes: Their full names.
    """
    counts = {each.topic: each.count for each in bag.channels}
    for topic in bag.ledger.topics if bag.ledger is not None else ():
        name, published, there = topic.get("name"), topic.get("published"), counts.get(str(topic.get("name")))
        if name not in topics:
            continue
        if isinstance(published, int) and there is not None and there != published:
            yield f"{name}: the run published {counted(published, 'message')}, and the recording has {there} of them"
        if lost := _lost(topic):
            missed = counted(lost, "message was", "messages were")
            yield f"{name}: {missed} lost between processes, and given in the replay"
        for subscription in mappings(topic.get("subscriptions")):
            dropped = _dropped(subscription)
            if subscription.get("node") in nodes and dropped > 0:
                yield f"{name}: {subscription['node']} lost {counted(dropped, 'message')}, and had all in the replay"


def shares(bag: Bag, nodes: Collection[str]) -> dict[tuple[str, str], int]:
    """By node and topic, the number of recorded messages that reached the node: the later ones came too late.

    A publisher may stop after its subscribers, or in another process. Cases that the recording does not show are left
    out: a killed process, messages lost on their way to another process, two subscriptions.
    """
    if bag.ledger is None or bag.incomplete:
        return {}
    counts = {each.topic: each.count for each in bag.channels}
    found: dict[tuple[str, str], list[int]] = {}
    for topic in bag.ledger.topics:
        name = str(topic.get("name"))
        if _lost(topic) or topic.get("published") != counts.get(name):
            continue
        for line in mappings(topic.get("subscriptions")):
            had = line.get("published" if _dropped(line) else "delivered")
            if line.get("node") in nodes and isinstance(had, int):
                had -= _unmatched(line) if _dropped(line) else 0
                found.setdefault((str(line["node"]), name), []).append(had)
    return {key: had[0] for key, had in found.items() if len(had) == 1}


def _dropped(line: Mapping[str, Any]) -> int:
    """The number of messages that a subscription dropped: those that arrived in its process."""
    dropped = line.get("dropped")
    return dropped - _unmatched(line) if isinstance(dropped, int) else 0


def _unmatched(line: Mapping[str, Any]) -> int:
    """The number of messages published while a subscription's process was not there."""
    drops = line.get("drops")
    count = cast("Mapping[Any, Any]", drops).get(UNMATCHED) if isinstance(drops, dict) else None
    return count if isinstance(count, int) else 0


def _lost(topic: Mapping[str, Any]) -> int:
    """The number of messages on a topic that were lost between processes."""
    losses = cast("Mapping[Any, Any]", topic.get("losses") if isinstance(topic.get("losses"), dict) else {})
    # What the inbox of threads lost was never published, and so is in no recording.
    return sum(n for reason, n in losses.items() if isinstance(n, int) and not str(reason).startswith("inbox_"))


@dataclass(slots=True)
class Past:
    """The set-up of the recorded run, and its ticking timers."""

    started_ns: int
    """The recording's time at which the run's own time was 0: by its ticks, else the recording's start."""
    simulated: bool
    """True if its time was simulated, and so is exactly the same in a replay."""
    seed: int
    ours: bool
    """True for a recording of busflow."""
    parameters: Mapping[str, Mapping[str, object]]
    """The parameters at the start, by node."""
    ticks: Counter[tuple[str, str]] = field(default_factory=Counter[tuple[str, str]])
    """The number of ticks, by node and timer."""
    ticks_in_order: bool = True
    """True if no tick has an earlier time than one before it: no clock was set back."""
    answered: set[str] = field(default_factory=set[str])
    """The services that were answered at all."""


def past_of(bag: Bag) -> Past:
    """Read the facts of a recording; of another program's, its start and parameters.

    Raises:
        BagError: There is nothing in it.
    """
    facts = bag.facts
    started_ns = bag.start_ns if facts is None or facts.started_ns is None else facts.started_ns
    if started_ns is None:
        raise BagError("there is no message in it, so nothing can be replayed", file=str(bag.path))
    parameters: dict[str, dict[str, object]] = {}
    ticks: Counter[tuple[str, str]] = Counter()
    answered: set[str] = set()
    began, latest_ns, in_order = None, 0, True
    for entry in bag.entries(lambda channel: channel.topic in {PARAMETER_EVENTS, TICKS} or _is_call(channel)):
        if _is_call(entry.channel):
            answered |= _answered(entry)
        elif entry.channel.topic == TICKS:
            tick = tick_of(entry)
            if tick is not None:
                ticks[tick.node, tick.timer] += 1
                began = began or tick
                in_order = in_order and tick.time_ns >= latest_ns
                latest_ns = tick.time_ns
        else:
            _learn(parameters, _event(entry), first_only=facts is not None)
    if began is not None:
        started_ns = began.time_ns - began.elapsed_ns
    simulated = facts is not None and facts.clock == "sim"
    seed = facts.seed if facts is not None and facts.seed is not None else 0
    return Past(started_ns, simulated, seed, facts is not None, parameters, ticks, in_order, answered)


def change_of(entry: Entry) -> tuple[str, dict[str, object]]:
    """The node whose parameters changed, and their new values; of one that was deleted, None."""
    event = _event(entry)
    changed = {each.name: plain_value(each.value) for each in (*event.new_parameters, *event.changed_parameters)}
    return event.node, changed | {each.name: None for each in event.deleted_parameters}


def tick_of(entry: Entry) -> Tick | None:
    """The tick that was recorded; None where it is nothing of the kind."""
    try:
        return Tick.parse(entry.channel.decode(entry.payload, String).data, entry.log_time_ns)
    except (BagError, MalformedMessage):
        return None


def _learn(parameters: dict[str, dict[str, object]], event: ParameterEvent, *, first_only: bool) -> None:
    """In a busflow recording the first event of a node has all its parameters; in ROS 2's they come one by one."""
    if first_only and event.node in parameters:
        return
    known = parameters.setdefault(event.node, {})
    for each in event.new_parameters:
        known.setdefault(each.name, plain_value(each.value))


def _is_call(channel: Channel) -> bool:
    return channel.topic.endswith(SUFFIX)


def _answered(entry: Entry) -> set[str]:
    """The service, if this event is an answer of it."""
    try:
        answer = entry.channel.plain(entry.payload)["response"]
    except (BagError, MalformedMessage, LookupError, TypeError):
        return set()
    return {entry.channel.topic.removesuffix(SUFFIX)} if len(answer) else set()


def _event(entry: Entry) -> ParameterEvent:
    return entry.channel.decode(entry.payload, ParameterEvent)
