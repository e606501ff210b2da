"""What the recorded run tells of messages that its recording has not, or that a node never had."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Any, cast

from busflow.text import counted

if TYPE_CHECKING:
    from busflow.recording.bag.bag import Bag


def loss_notes(bag: Bag, topics: Collection[str], nodes: Collection[str]) -> Iterator[str]:
    """A line for each topic of the nodes whose recorded messages are not those that they had.

    Args:
        bag: The recording, whose ledger is asked.
        topics: What the nodes publish and receive.
        nodes: Their full names.
    """
    counts = {each.topic: each.count for each in bag.channels}
    for told in _topics(bag.ledger.report if bag.ledger is not None else {}):
        name, published, there = told.get("name"), told.get("published"), counts.get(str(told.get("name")))
        if name not in topics:
            continue
        if isinstance(published, int) and there is not None and there != published:
            yield f"{name}: the run published {counted(published, 'message')}, and the recording has {there} of them"
        if lost := _lost(told):
            missed = counted(lost, "message was", "messages were")
            yield f"{name}: {missed} lost between processes, and given in the replay"
        for subscription in _mappings(told.get("subscriptions")):
            dropped = subscription.get("dropped")
            if subscription.get("node") in nodes and isinstance(dropped, int) and dropped > 0:
                yield f"{name}: {subscription['node']} lost {counted(dropped, 'message')}, and had all in the replay"


def shares(bag: Bag, nodes: Collection[str]) -> dict[tuple[str, str], int]:
    """By node and topic, how many of the recorded messages the node had, from the first on: the others came too late.

    Whoever publishes may stop after those who receive, or in another process. Left out is what the recording does not
    tell: of a process that was killed, of messages that were lost on their way to another one, of two subscriptions.
    """
    if bag.ledger is None or bag.incomplete:
        return {}
    counts = {each.topic: each.count for each in bag.channels}
    found: dict[tuple[str, str], list[int]] = {}
    for told in _topics(bag.ledger.report):
        name = str(told.get("name"))
        if _lost(told) or told.get("published") != counts.get(name):
            continue
        for line in _mappings(told.get("subscriptions")):
            had = line.get("published" if line.get("dropped") else "delivered")
            if line.get("node") in nodes and isinstance(had, int):
                found.setdefault((str(line["node"]), name), []).append(had)
    return {key: had[0] for key, had in found.items() if len(had) == 1}


def _topics(report: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    return _mappings(report.get("topics"))


def _lost(topic: Mapping[str, Any]) -> int:
    """How many messages on a topic did not come through from one process to another."""
    losses = cast("Mapping[Any, Any]", topic.get("losses") if isinstance(topic.get("losses"), dict) else {})
    return sum(count for count in losses.values() if isinstance(count, int))


def _mappings(told: Any) -> Iterator[Mapping[str, Any]]:
    """A report comes from a file, in which anything may stand."""
    items = cast("list[Any]", told) if isinstance(told, list) else []
    yield from (cast("Mapping[str, Any]", each) for each in items if isinstance(each, dict))
