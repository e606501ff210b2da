"""Checks endpoints: conflicts between the declarations of nodes, and endpoints without counterpart."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from typing import TYPE_CHECKING

from busflow.actions.names import SEND_GOAL, action_of, action_type_of
from busflow.bus.endpoint import UNANNOUNCED, Endpoint, ServiceEndpoint
from busflow.bus.names import resolve
from busflow.bus.qos_matching import Verdict, compatibility
from busflow.errors import Problem, Severity
from busflow.interfaces.message import type_name
from busflow.launchfile.model.problems import problem_at
from busflow.runner.planning.stated_qos import StatedQoS, type_place
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.launchfile.model.description import TopicSpec
    from busflow.runner.planning.planned_node import PlannedNode

NO_TOPICS = "leave it out: the nodes have no topics"
_NO_SERVER = "add a node that answers it"
_ADVISED = 20
"""Problems of one kind that get the nearest name: each costs up to 20 ms on the loop, and all would be quadratic."""


def unmatched_ends(nodes: Sequence[PlannedNode], topics: Sequence[TopicSpec], *, strict: bool) -> Iterator[Problem]:
    """Yield topics without publisher or subscription and services without server, given all nodes of a graph.

    Args:
        nodes: The nodes.
        topics: The topic entries of the launch file.
        strict: Make a missing publisher or server an error.
    """
    meant = [name for planned in nodes for name in _unused_names(planned)]
    yield from _unused_topic_entries(nodes, [each for each in topics if each.topic not in meant])
    if not meant:
        yield from _unmatched_topics(nodes, {each.topic for each in topics if each.external}, strict=strict)
    yield from _unanswered_calls(nodes, strict=strict)


def unused_entries(planned: PlannedNode) -> Iterator[Problem]:
    """Yield the QoS entries and remaps of a node that match none of its endpoints."""
    spec = planned.spec
    if spec is None:
        return
    for kind, stated, endpoints in (
        ("publish", spec.publishers, planned.publishers),
        ("subscribe to", spec.subscriptions, planned.subscriptions),
    ):
        topics = {endpoint.topic for endpoint in endpoints}
        for each in stated:
            if each.full_topic(spec.name, spec.namespace) not in topics:
                text = f"{spec.full_name} does not {kind} {each.topic}"
                known = topics | {endpoint.written for endpoint in endpoints}
                fix = did_you_mean(each.topic, known, none=f"leave it out: the node does not {kind} any topic")
                yield problem_at("unknown-topic", text, fix, each.origin)
    ends = (*planned.publishers, *planned.subscriptions, *planned.servers, *planned.clients)
    written = {endpoint.written for endpoint in ends}
    for rule in spec.remap:
        if rule.match not in planned.runtime.used_remaps:
            text = f"the remap of {rule.match} matches no topic or service of {spec.full_name}"
            fix = did_you_mean(rule.match, written, none="leave it out: the node has no topics and no services")
            yield problem_at("unused-remap", text, fix, rule.origin)


def _unused_names(planned: PlannedNode) -> Iterator[str]:
    """Yield the topic names that a node's unused remaps would give."""
    spec = planned.spec
    for rule in spec.remap if spec is not None else ():
        if spec is not None and rule.match not in planned.runtime.used_remaps:
            yield resolve(rule.replacement, node=spec.name, namespace=spec.namespace, remaps={}).name


def _unused_topic_entries(nodes: Sequence[PlannedNode], topics: Sequence[TopicSpec]) -> Iterator[Problem]:
    """Yield entries under `topics:` without an endpoint, or with another type than the endpoint."""
    used = {endpoint.topic: endpoint for planned in nodes for endpoint in (*planned.publishers, *planned.subscriptions)}
    for spec in topics:
        endpoint = used.get(spec.topic)
        if endpoint is None:
            text = f"no node publishes or receives the topic {spec.topic}"
            yield problem_at("unknown-topic", text, did_you_mean(spec.topic, used, none=NO_TOPICS), spec.origin)
        elif spec.type is not None and spec.type not in _spellings(endpoint):
            actual = type_name(endpoint.type)
            text = f"the topic {spec.topic} carries {actual}, not {spec.type}"
            yield problem_at("type-mismatch", text, f"write type: {actual}", spec.origin)


def _unmatched_topics(nodes: Sequence[PlannedNode], external: Collection[str], *, strict: bool) -> Iterator[Problem]:
    published = {endpoint.topic for planned in nodes for endpoint in planned.publishers}
    received = {endpoint.topic for planned in nodes for endpoint in planned.subscriptions}
    advised = _ADVISED
    for planned in nodes:
        for endpoint in planned.subscriptions:
            if action_of(endpoint.topic) is not None:  # its action's services are compared
                continue
            if endpoint.topic not in published and endpoint.topic not in {*external, *UNANNOUNCED}:
                advised -= 1
                near = did_you_mean(endpoint.topic, published) if published and advised >= 0 else None
                outside = f"if it is published from outside: topics: {{{endpoint.topic}: {{external: true}}}}"
                fixes = [near, outside if planned.spec is not None else None]
                yield planned.problem(
                    "nobody-publishes",
                    f"{endpoint.origin} of {endpoint.node} receives {endpoint.topic}, which has no publisher",
                    "; ".join(filter(None, fixes)) or None,
                    Severity.ERROR if strict else Severity.WARNING,
                )
        for endpoint in planned.publishers:
            if endpoint.topic not in received and endpoint.topic not in external and action_of(endpoint.topic) is None:
                text = f"{endpoint.origin} of {endpoint.node} publishes {endpoint.topic}, which has no subscription"
                yield planned.problem("nobody-receives", text, None, Severity.INFO)


def _unanswered_calls(nodes: Sequence[PlannedNode], *, strict: bool) -> Iterator[Problem]:
    served = {endpoint.service for planned in nodes for endpoint in planned.servers}
    names = {True: _actions_among(served), False: {name for name in served if action_of(name) is None}}
    advised = _ADVISED
    for planned in nodes:
        for endpoint in planned.clients:
            if endpoint.service not in served and not _is_beside_goals(endpoint):
                action = _action(endpoint)
                what = _said(endpoint, "calls", "sends goals to")
                text = f"{endpoint.origin} of {endpoint.node} {what}, which has no server"
                severity = Severity.ERROR if strict else Severity.WARNING
                advised -= 1
                fix = (
                    did_you_mean(action or endpoint.service, names[action is not None], none=_NO_SERVER)
                    if advised >= 0
                    else None
                )
                yield planned.problem("nobody-answers", text, fix, severity)


def _actions_among(services: Collection[str]) -> set[str]:
    return {name.removesuffix(SEND_GOAL) for name in services if name.endswith(SEND_GOAL)}


def _action(endpoint: ServiceEndpoint) -> str | None:
    """Return the action to whose `send_goal` an endpoint belongs."""
    return endpoint.service.removesuffix(SEND_GOAL) if endpoint.service.endswith(SEND_GOAL) else None


def _said(endpoint: ServiceEndpoint, of_service: str, of_action: str) -> str:
    """Return a word with the name of an endpoint's service, or another one with that of its action."""
    action = _action(endpoint)
    return f"{of_service} {endpoint.service}" if action is None else f"{of_action} {action}"


def _is_beside_goals(endpoint: ServiceEndpoint) -> bool:
    """Return whether an endpoint is one of an action's that says no more than its `send_goal`."""
    return action_of(endpoint.service) is not None and not endpoint.service.endswith(SEND_GOAL)


def _spellings(endpoint: Endpoint) -> tuple[str, str]:
    """Return both spellings of a message type: `pkg/msg/Type` and `pkg/Type`."""
    full = type_name(endpoint.type)
    return full, full.replace("/msg/", "/")


def conflicts(nodes: Sequence[PlannedNode], topics: Sequence[TopicSpec] = (), *, qos: bool = True) -> Iterator[Problem]:
    """Yield nodes with the same name, and topics and services whose endpoints do not fit; compare QoS if `qos`."""
    yield from _duplicate_names(nodes)
    yield from _type_conflicts(nodes)
    if qos:
        yield from _qos_conflicts(nodes, topics)
    yield from _service_conflicts(nodes)


def _duplicate_names(nodes: Sequence[PlannedNode]) -> Iterator[Problem]:
    seen: dict[str, PlannedNode] = {}
    for planned in nodes:
        first = seen.setdefault(planned.runtime.full_name, planned)
        if first is not planned:
            where = f", first at {first.place}" if first.place else ""
            yield planned.problem(
                "duplicate-node",
                f"two nodes are called {planned.runtime.full_name}{where}",
                "give one of them another name or namespace",
            )


def _type_conflicts(nodes: Sequence[PlannedNode]) -> Iterator[Problem]:
    """Yield endpoints whose type differs from that of the topic's first endpoint."""
    first: dict[str, Endpoint] = {}
    for planned, endpoint in ((each, end) for each in nodes for end in (*each.publishers, *each.subscriptions)):
        stated = first.setdefault(endpoint.topic, endpoint)
        if stated.type is not endpoint.type and action_of(endpoint.topic) is None:
            yield planned.problem(
                "type-mismatch",
                f"{endpoint.origin} uses {endpoint.topic} as {type_name(endpoint.type)}, but {stated.origin} "
                f"uses it as {type_name(stated.type)}",
                f"use one type on both ends, or remap one of them: remap: {{{endpoint.written}: another_name}}",
                at=type_place(planned, endpoint),
            )


def _qos_conflicts(nodes: Sequence[PlannedNode], topics: Sequence[TopicSpec]) -> Iterator[Problem]:
    offers: dict[str, list[tuple[PlannedNode, Endpoint]]] = defaultdict(list)
    for planned in nodes:
        for endpoint in planned.publishers:
            offers[endpoint.topic].append((planned, endpoint))
    for planned in nodes:
        for requested in planned.subscriptions:
            for publisher, offered in offers[requested.topic]:
                found = compatibility(offered.qos, requested.qos)
                if found.verdict is Verdict.ERROR:
                    ends = (
                        StatedQoS.of("subscriptions", planned, requested, found.requests, topics),
                        StatedQoS.of("publishers", publisher, offered, found.offers, topics),
                    )
                    yield planned.problem(
                        "qos-mismatch",
                        f"{requested.origin} of {requested.node} cannot receive {requested.topic} from "
                        f"{offered.node}: {'; '.join(found.reasons)}",
                        ", or ".join(end.fix for end in ends),
                        at=next((end.place for end in ends if end.place), ()),
                    )


def _service_conflicts(nodes: Sequence[PlannedNode]) -> Iterator[Problem]:
    """Yield services with several types or several servers."""
    stated: dict[str, ServiceEndpoint] = {}
    served: dict[str, ServiceEndpoint] = {}
    for planned in nodes:
        for endpoint in (*planned.servers, *planned.clients):
            first = stated.setdefault(endpoint.service, endpoint)
            if first.type is not endpoint.type and not _is_beside_goals(endpoint):
                what = _said(endpoint, "the service", "the action")
                text = f"{endpoint.origin} uses {what} as {_type_of(endpoint)}, but "
                text += f"{first.origin} uses it as {_type_of(first)}"
                fix = _rename(endpoint, "use one type on both ends")
                yield planned.problem("type-mismatch", text, fix, at=type_place(planned, endpoint))
        for endpoint in planned.servers:
            first = served.setdefault(endpoint.service, endpoint)
            if first is not endpoint and not _is_beside_goals(endpoint):
                what, verb = _said(endpoint, "answers", "serves"), "answers" if _action(endpoint) is None else "serves"
                text = (
                    f"{endpoint.origin} of {endpoint.node} {what}, which {first.origin} of {first.node} {verb} already"
                )
                yield planned.problem("two-servers", text, _rename(endpoint))


def _type_of(endpoint: ServiceEndpoint) -> str:
    """Return the name of a service's type, or of the action's of which it is derived."""
    name = type_name(endpoint.type)
    return action_type_of(name) or name


def _rename(endpoint: ServiceEndpoint, otherwise: str = "") -> str:
    renaming = f"remap one of them: remap: {{{endpoint.written}: another_name}}"
    return f"{otherwise}, or {renaming}" if otherwise else renaming
