"""Answer to `graph`: nodes, topics and services of a run, with counts, rates and timers, as a page draws them. Pure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from busflow.commands import is_hidden

if TYPE_CHECKING:
    from busflow.commands import EndView, GraphView, NodeView, TopicView

_UNSTATED: Mapping[str, Any] = {}
_SEND_GOAL = "/_action/send_goal"
"""Ending of the service by which ROS 2's graph names an action; its type ends in `_SendGoal`."""
_COUNTS = ("delivered", "dropped", "queued", "depth", "overflow", "deadlines_missed")


@dataclass(frozen=True, slots=True)
class Moment:
    """Graph of a run at one moment."""

    graph: GraphView
    at_s: float
    """Moment in seconds, on any clock that does not jump."""


def graph_answer(now: Moment, before: Moment | None, sources: Mapping[str, str]) -> dict[str, Any]:
    """Return what the page draws.

    Args:
        now: the graph.
        before: the graph some time ago, for rates; without it they are None.
        sources: where each node is stated or written, by its name.
    """
    processes = now.graph.processes
    timers = [timer for answer in processes for timer in answer["timers"]]
    return {
        "elapsed_s": max((answer["elapsed_s"] for answer in processes), default=None),
        "clock": ", ".join(dict.fromkeys(answer["clock"] for answer in processes)),
        "inbox": [{"process": each["process"], **each["inbox"]} for each in processes if any(each["inbox"].values())],
        "nodes": [_node(each, timers, sources.get(each.name)) for each in now.graph.nodes.values()],
        "topics": [_topic(each, now, before) for each in now.graph.topics.values()],
        "services": [_service(each, processes) for each in now.graph.services.values()],
    }


def _node(node: NodeView, timers: Sequence[Mapping[str, Any]], source: str | None) -> dict[str, Any]:
    details = node.details
    process = str(details.get("process", ""))
    machine, _, own = process.rpartition(":")
    return {
        "name": node.name,
        "namespace": node.name.rpartition("/")[0] or "/",
        "process": own or None,
        "machine": machine or None,
        "pid": details.get("pid"),
        "state": details.get("state", "unknown"),
        "plugin": details.get("plugin"),
        "source": source,
        "restarts": details.get("restarts", 0),
        "stopped_by_hand": details.get("stopped_by_hand", 0),
        "failures": details.get("failures", []),
        "depends_on": details.get("depends_on", []),
        "is_busflow": bool(details),
        "hidden": node.hidden,
        "timers": [_timer(each) for each in timers if each["node"] == node.name],
        "publishers": _names(node.publishers),
        "subscriptions": _names(node.subscriptions),
        "services": _names(node.services),
        "clients": _names(node.clients),
    }


def _timer(timer: Mapping[str, Any]) -> dict[str, Any]:
    return {word: value for word, value in timer.items() if word != "node"}


def _names(ends: Sequence[EndView]) -> list[str]:
    return sorted({end.token.topic for end in ends})


def _topic(topic: TopicView, now: Moment, before: Moment | None) -> dict[str, Any]:
    published = int(topic.details.get("published", 0))
    losses: dict[str, int] = {}
    for answer in now.graph.processes:
        for each in answer["topics"]:
            if each["name"] == topic.name:
                for reason, count in each["losses"].items():
                    losses[reason] = losses.get(reason, 0) + count
    return {
        "name": topic.name,
        "type": topic.type,
        "hidden": topic.hidden,
        "external": bool(topic.details.get("external")),
        "published": published,
        "rate_hz": _rate_hz(topic.name, published, now, before),
        "publishers": [_publisher(each) for each in topic.publishers],
        "subscriptions": [_subscription(each) for each in topic.subscriptions],
        "losses": {reason: count for reason, count in losses.items() if count},
    }


def _rate_hz(name: str, published: int, now: Moment, before: Moment | None) -> float | None:
    if before is None or now.at_s <= before.at_s or name not in before.graph.topics:
        return None
    earlier = int(before.graph.topics[name].details.get("published", 0))
    return round(max(0, published - earlier) / (now.at_s - before.at_s), 3)


def _publisher(end: EndView) -> dict[str, Any]:
    return {**_end(end), "published": end.details.get("published")}


def _subscription(end: EndView) -> dict[str, Any]:
    drops: Mapping[str, int] = end.details.get("drops", _UNSTATED)
    counts = {word: end.details.get(word) for word in ("published", *_COUNTS)}
    return {**_end(end), **counts, "reasons": {reason: count for reason, count in drops.items() if count}}


def _end(end: EndView) -> dict[str, Any]:
    """Return what both kinds of ends state; the QoS of another program's is the one that it announces."""
    qos = end.details.get("qos")
    if qos is None:
        offered = end.qos
        qos = {word: getattr(offered, word) for word in ("reliability", "durability", "depth")}
    return {"node": end.node, "qos": qos, "origin": end.details.get("origin")}


def _service(service: TopicView, processes: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    lines = [each for answer in processes for each in answer["services"] if each["name"] == service.name]
    servers = [line for each in lines for line in each["servers"]]
    clients = [line for each in lines for line in each["clients"]]
    name = service.name.removesuffix(_SEND_GOAL)
    is_action = name != service.name
    return {
        "name": name,
        "type": service.type.removesuffix("_SendGoal") if is_action else service.type,
        "is_action": is_action,
        "hidden": is_hidden(name) or service.type.startswith("rcl_interfaces/srv/"),
        "servers": servers or [{"node": end.node} for end in service.publishers],
        "clients": clients or [{"node": end.node} for end in service.subscriptions],
    }
