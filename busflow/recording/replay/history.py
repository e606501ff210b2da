"""Facts of a recording that a replay needs beforehand: parameters, timers, lost messages."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, cast

from busflow.actions.names import SEND_GOAL
from busflow.bus.endpoint import PARAMETER_EVENTS
from busflow.bus.statistics import UNMATCHED
from busflow.errors import BagError, MalformedMessage
from busflow.msgs.rcl_interfaces import ParameterEvent
from busflow.msgs.service_msgs import ServiceEventInfo
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
    """Yield lines for people about topics on which the nodes get other messages in the replay than they got in the run.

    Args:
        bag: The recording; its ledger has the counts of the run.
        topics: The topics that the nodes publish and receive.
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
            yield f"{name}: {missed} lost between processes in the run, but not in the replay"
        for line in mappings(topic.get("subscriptions")):
            dropped = _dropped(line)
            if line.get("node") in nodes and dropped > 0:
                yield f"{name}: {line['node']} dropped {counted(dropped, 'message')}, but received all in the replay"


def shares(bag: Bag, nodes: Collection[str]) -> dict[tuple[str, str], int]:
    """Return, by node and topic, how many of the recorded messages reached the node in the run: always the first ones.

    The later ones came after the node had stopped: its publisher stopped after it, or runs in another process. The
    result leaves out the cases in which the ledger does not show this number: a killed process, messages lost on their
    way to another process, a node with two subscriptions to the topic.
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
            received = line.get("published" if _dropped(line) else "delivered")
            if line.get("node") in nodes and isinstance(received, int):
                received -= _unmatched(line) if _dropped(line) else 0
                found.setdefault((str(line["node"]), name), []).append(received)
    return {key: numbers[0] for key, numbers in found.items() if len(numbers) == 1}


def _dropped(line: Mapping[str, Any]) -> int:
    """Return how many messages a subscription dropped after they had arrived in its process."""
    dropped = line.get("dropped")
    return dropped - _unmatched(line) if isinstance(dropped, int) else 0


def _unmatched(line: Mapping[str, Any]) -> int:
    """Return how many messages were published while the subscription's process was not there."""
    drops = line.get("drops")
    count = cast("Mapping[Any, Any]", drops).get(UNMATCHED) if isinstance(drops, dict) else None
    return count if isinstance(count, int) else 0


def _lost(topic: Mapping[str, Any]) -> int:
    """Return how many messages of a topic were lost between processes."""
    losses = cast("Mapping[Any, Any]", topic.get("losses") if isinstance(topic.get("losses"), dict) else {})
    # A message that the inbox of threads lost was never published, and so is in no recording.
    return sum(n for reason, n in losses.items() if isinstance(n, int) and not str(reason).startswith("inbox_"))


@dataclass(slots=True)
class Past:
    """The set-up of the recorded run, its ticking timers and its answered services."""

    started_ns: int
    """The time at which the recorded run began: by its ticks if it has any, else the recording's start."""
    simulated: bool
    """True if the run's time was simulated: then the times of a replay are exactly the same."""
    seed: int
    by_busflow: bool
    """True if busflow made the recording, and not another program."""
    parameters: Mapping[str, Mapping[str, object]]
    """The parameters at the start, by node."""
    ticks: Counter[tuple[str, str]] = field(default_factory=Counter[tuple[str, str]])
    """The number of ticks, by node and timer."""
    ticks_in_order: bool = True
    """True if no tick has an earlier time than one before it: no clock was set back."""
    answered: set[str] = field(default_factory=set[str])
    """The services of which the recording has an answer."""
    goals: dict[tuple[str, bytes], list[bytes]] = field(default_factory=dict[tuple[str, bytes], list[bytes]])
    """The identifiers of the goals that were sent, by service and the client's gid."""


def past_of(bag: Bag) -> Past:
    """Read the facts of a recording; one that another program made states neither seed nor clock, and has no ticks.

    Raises:
        BagError: The recording has no message.
    """
    facts = bag.facts
    started_ns = bag.start_ns if facts is None or facts.started_ns is None else facts.started_ns
    if started_ns is None:
        raise BagError("there is no message in it, so nothing can be replayed", file=str(bag.path))
    parameters: dict[str, dict[str, object]] = {}
    ticks: Counter[tuple[str, str]] = Counter()
    answered: set[str] = set()
    goals: dict[tuple[str, bytes], list[bytes]] = {}
    first_tick, latest_ns, in_order = None, 0, True
    for entry in bag.entries(lambda channel: channel.topic in {PARAMETER_EVENTS, TICKS} or _is_call(channel)):
        if _is_call(entry.channel):
            _add_call(entry, answered, goals)
        elif entry.channel.topic == TICKS:
            tick = tick_of(entry)
            if tick is not None:
                ticks[tick.node, tick.timer] += 1
                first_tick = first_tick or tick
                in_order = in_order and tick.time_ns >= latest_ns
                latest_ns = tick.time_ns
        else:
            _add_parameters(parameters, _event(entry), first_only=facts is not None)
    if first_tick is not None:
        started_ns = first_tick.time_ns - first_tick.elapsed_ns
    simulated = facts is not None and facts.clock == "sim"
    seed = facts.seed if facts is not None and facts.seed is not None else 0
    return Past(started_ns, simulated, seed, facts is not None, parameters, ticks, in_order, answered, goals)


def change_of(entry: Entry) -> tuple[str, dict[str, object]]:
    """Return the node whose parameters changed, and their new values; the value of a deleted parameter is None."""
    event = _event(entry)
    changed = {each.name: plain_value(each.value) for each in (*event.new_parameters, *event.changed_parameters)}
    return event.node, changed | {each.name: None for each in event.deleted_parameters}


def tick_of(entry: Entry) -> Tick | None:
    """Return the recorded tick; None if the message is not a tick."""
    try:
        return Tick.parse(entry.channel.decode(entry.payload, String).data, entry.log_time_ns)
    except (BagError, MalformedMessage):
        return None


def _add_parameters(parameters: dict[str, dict[str, object]], event: ParameterEvent, *, first_only: bool) -> None:
    """Add an event's parameters. A node's first event in a busflow recording has all; in ROS 2 they come one by one."""
    if first_only and event.node in parameters:
        return
    known = parameters.setdefault(event.node, {})
    for each in event.new_parameters:
        known.setdefault(each.name, plain_value(each.value))


def _is_call(channel: Channel) -> bool:
    return channel.topic.endswith(SUFFIX)


def _add_call(entry: Entry, answered: set[str], goals: dict[tuple[str, bytes], list[bytes]]) -> None:
    """Add the service of which this event is an answer, or the goal that its request sends."""
    service = entry.channel.topic.removesuffix(SUFFIX)
    try:
        event = entry.channel.plain(entry.payload)
        if len(event["response"]):
            answered.add(service)
        elif service.endswith(SEND_GOAL) and event["info"]["event_type"] == ServiceEventInfo.REQUEST_RECEIVED:
            client = service, bytes([*event["info"]["client_gid"]])
            goals.setdefault(client, []).append(bytes([*event["request"][0]["goal_id"]["uuid"]]))
    except (BagError, MalformedMessage, LookupError, TypeError, ValueError):
        return


def _event(entry: Entry) -> ParameterEvent:
    return entry.channel.decode(entry.payload, ParameterEvent)
