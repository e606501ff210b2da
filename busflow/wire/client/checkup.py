"""Findings: what is wrong in a running graph, by its processes' answers, each with a remedy. Pure."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from busflow.bus.endpoint import UNANNOUNCED
from busflow.bus.names import is_hidden
from busflow.bus.qos_matching import Verdict, compatibility
from busflow.bus.statistics import EARLY, LOST, OUTGOING, UNSENT, reasons_text
from busflow.errors import MalformedMessage, Problem, Severity
from busflow.text import counted, did_you_mean
from busflow.wire.client.graph_view import EndView, GraphView, TopicView
from busflow.wire.zenoh.keys import Token, TokenKind
from busflow.wire.zenoh.qos_text import as_qos, from_text

Answers = Sequence[Mapping[str, Any]]

_MISSED_SHARE = 0.01
"""A timer that misses a larger share of its ticks is reported."""
_REMEDIES: Mapping[str, str] = {
    "overflow": "raise its depth, make its handler faster, or choose overflow: block",
    "no_transform": "see which edge lags: busflow tf monitor; or raise wait",
    "unpaired": "stamp both topics with the time of the measurement, raise within, or raise depth",
    "expired": "they waited longer than the publisher's lifespan: make the handler faster, or raise the lifespan",
}
_LOSSES: Mapping[str, tuple[str, str]] = {
    LOST: (
        "never arrived",
        "their link broke meanwhile, or the process was too busy to take them in: see busflow log --level warning",
    ),
    "malformed": ("could not be read", "let the other process use the same definition of the type"),
    "refused": ("found a full queue with overflow: block", "raise its depth, or choose overflow: drop_oldest"),
    "incompatible": ("did not fit who receives them", "see the log: busflow log --level warning"),
    EARLY: (
        "were published before these had let the publisher in",
        "publish fewer at once when a publisher is new, raise the subscription's depth, or use transient_local",
    ),
    UNSENT: (
        "were not sent",
        "see busflow log --level warning: publish smaller messages, or receive the topic in the same process",
    ),
    "unsigned": ("came from no publisher that is there", "a publisher has to declare itself, as those of ROS 2 do"),
}

_CALLS: Mapping[str, tuple[str, str]] = {
    "failed": ("failed in {node}", "busflow log --level error shows why"),
    "refused": ("found no room at {node}", "raise its depth, or make its handler faster"),
    "withdrawn": ("got no answer from {node} in time", "make its handler faster, or wait longer"),
    "timed_out": ("took longer than {node} waited", "raise its timeout, or make the handler faster"),
}
"""Failures of calls, by the words of both endpoints' statistics, and what to do about them."""


def findings(graph: GraphView, tokens: Sequence[Token], answers: Answers) -> list[Problem]:
    """Return everything that is wrong, the errors first."""
    found = (
        *_failed_nodes(graph),
        *_namesakes(tokens),
        *_type_conflicts(graph),
        *_qos_conflicts(graph),
        *_unpublished(graph),
        *_unanswered(graph),
        *_drops(graph),
        *_losses(answers),
        *_calls(answers),
        *_inbox(answers),
        *_timers(answers),
    )
    return sorted(found, key=lambda problem: problem.severity is not Severity.ERROR)


def _failed_nodes(graph: GraphView) -> Iterator[Problem]:
    for node in graph.nodes.values():
        if node.details.get("state") == "failed":
            why = "; ".join(node.details.get("failures", [])) or "it does not say why"
            yield Problem("node-failed", f"{node.name} has failed: {why}", "see busflow log --level error")
        elif node.details.get("state") == "stopped by hand":
            fix = f"busflow node start {node.name.removeprefix('/')}"
            yield Problem("node-stopped", f"{node.name} is stopped by hand", fix, severity=Severity.WARNING)
        elif restarts := node.details.get("restarts", 0):
            why = "; ".join(node.details.get("failures", [])) or "see busflow log --level warning"
            text, fix = f"{node.name} was started anew {counted(restarts, 'time')}", "mend what makes it fail"
            yield Problem("node-restarted", f"{text}: {why}", fix, severity=Severity.WARNING)


def _namesakes(tokens: Sequence[Token]) -> Iterator[Problem]:
    sessions: defaultdict[str, list[str]] = defaultdict(list)
    for token in tokens:
        if token.kind is TokenKind.NODE and not is_hidden(token.node_name):
            sessions[token.node_name].append(token.session)
    for name, found in sessions.items():
        if len(found) > 1:
            fix = "give one of them another name or namespace"
            yield Problem("duplicate-node", f"{len(found)} nodes are called {name}", fix)


def _type_conflicts(graph: GraphView) -> Iterator[Problem]:
    for topic in (each for each in graph.topics.values() if len(each.kinds) > 1):
        users: dict[tuple[str, str | None], list[str]] = {kind: [] for kind in topic.kinds}
        for end in (*topic.publishers, *topic.subscriptions):
            if (kind := (end.token.type, end.token.known_hash)) in users:
                users[kind].append(end.node)
        listed = [f"{type_} ({', '.join(dict.fromkeys(nodes))})" for (type_, _), nodes in users.items()]
        if len(topic.types) > 1:
            text, fix = f"{topic.name} carries {' and '.join(listed)}", "use one type on all ends, or remap one of them"
        else:
            text = f"{topic.name} carries {len(users)} definitions of {' and '.join(listed)}"
            fix = "use the same definition of the type everywhere; who has another one receives nothing"
        yield Problem("type-mismatch", text, fix)


def _qos_conflicts(graph: GraphView) -> Iterator[Problem]:
    for topic in graph.topics.values():
        for end in (*topic.publishers, *topic.subscriptions):
            try:
                from_text(end.token.qos)
            except MalformedMessage as error:
                yield Problem("qos-mismatch", f"{end.node} states no QoS for {topic.name}: {error}")
        for publisher in topic.publishers:
            for subscription in topic.subscriptions:
                text = f"{subscription.node} cannot receive {topic.name} from {publisher.node}"
                found = compatibility(as_qos(publisher.qos), as_qos(subscription.qos))
                if found.verdict is Verdict.ERROR:
                    yield Problem("qos-mismatch", f"{text}: {'; '.join(found.reasons)}", found.fix)


def _unpublished(graph: GraphView) -> Iterator[Problem]:
    published = {topic.name for topic in graph.topics.values() if topic.publishers and not topic.hidden}
    for topic in (each for name, each in graph.topics.items() if name not in UNANNOUNCED):
        receivers = [end for end in topic.subscriptions if not is_hidden(end.node)]
        if receivers and not topic.publishers and not topic.details.get("external"):
            text = f"{_nodes(receivers)} receives {topic.name}, which has no publisher"
            fix = did_you_mean(topic.name, published, none="start a node that publishes it")
            yield Problem("nobody-publishes", text, fix, severity=Severity.WARNING)


def _unanswered(graph: GraphView) -> Iterator[Problem]:
    answered = {each.name for each in graph.services.values() if each.publishers and not _is_of_every_node(each)}
    for service in graph.services.values():
        clients = [end for end in service.subscriptions if not is_hidden(end.node)]
        if clients and not service.publishers:
            text = f"{_nodes(clients)} calls {service.name}, which has no server"
            fix = did_you_mean(service.name, answered, none="start a node that answers it")
            yield Problem("nobody-answers", text, fix, severity=Severity.WARNING)


def _is_of_every_node(service: TopicView) -> bool:
    """Return whether it is a service for parameters or log levels, which every node of ROS 2 has."""
    return service.type.startswith("rcl_interfaces/srv/")


def _calls(answers: Answers) -> Iterator[Problem]:
    for service in (each for answer in answers for each in answer.get("services", ())):
        for line in service["servers"]:
            yield from _went_wrong(service["name"], line, line["received"], ("failed", "refused", "withdrawn"))
        for line in service["clients"]:
            yield from _went_wrong(service["name"], line, line["called"], ("timed_out",))


def _went_wrong(service: str, line: Mapping[str, Any], calls: int, words: Sequence[str]) -> Iterator[Problem]:
    for word in words:
        if line[word]:
            what, fix = _CALLS[word]
            text = f"{line[word]} of {counted(calls, 'call')} of {service} {what.format(node=line['node'])}"
            yield Problem(f"calls-{word.replace('_', '-')}", text, fix, severity=Severity.WARNING)


def _drops(graph: GraphView) -> Iterator[Problem]:
    for topic in graph.topics.values():
        for end in topic.subscriptions:
            dropped = end.details.get("dropped", 0)
            if dropped:
                yield _dropped(topic, end, dropped)


def _dropped(topic: TopicView, end: EndView, dropped: int) -> Problem:
    reasons: Mapping[str, int] = end.details.get("drops", {})
    why = ", ".join(f"{reason} {count}" for reason, count in reasons.items() if count)
    worst = max(reasons, key=lambda reason: reasons[reason], default="")
    published = counted(end.details.get("published", 0), "message")
    text = f"{end.node} dropped {dropped} of {published} on {topic.name} ({why}), depth {end.details['depth']}"
    remark = end.details.get("remark") or ("it is a slow reader" if worst == "overflow" else "")
    text += f"; {remark}" if remark else ""
    return Problem("dropped", text, _REMEDIES.get(worst, "see busflow topic stats"), severity=Severity.WARNING)


def _losses(answers: Answers) -> Iterator[Problem]:
    for answer in answers:
        for topic in answer["topics"]:
            for reason, count in topic.get("losses", {}).items():
                if count and not reason.startswith("inbox_"):  # `_inbox` reports those
                    what, fix = _LOSSES.get(reason, (reason, ""))
                    way, end = ("to", "out") if reason in OUTGOING else ("from", "in")
                    what += _readers(topic) if reason == LOST else ""
                    text = f"{counted(count, 'message')} on {topic['name']} {way} other processes {what}"
                    yield Problem(f"{reason}-on-the-way-{end}", text, fix or None, severity=Severity.WARNING)


def _readers(topic: Mapping[str, Any]) -> str:
    """Return which nodes have lost messages, and for which reasons."""
    lost = {each["node"]: each.get("lost") for each in topic.get("subscriptions", ())}
    readers = [node + (f" ({reasons_text(reasons)})" if reasons else "") for node, reasons in lost.items()]
    return f" at {', '.join(readers)}" if readers else ""


def _inbox(answers: Answers) -> Iterator[Problem]:
    for answer in answers:
        for reason, what in (("dropped", "came too fast"), ("refused", "found a full queue")):
            count = answer.get("inbox", {}).get(reason, 0)
            if count:
                text = f"{counted(count, 'message')} that threads published {what}"
                fix = "publish less often from threads, or await send() on the loop"
                yield Problem(f"inbox-{reason}", text, fix, severity=Severity.WARNING)


def _timers(answers: Answers) -> Iterator[Problem]:
    for answer in answers:
        for timer in answer["timers"]:
            missed, ticks = timer["missed"], timer["fired"] + timer["missed"]
            if missed > _MISSED_SHARE * ticks:
                text = f"the timer {timer['name']} of {timer['node']} missed {missed} of {counted(ticks, 'tick')}"
                fix = "a handler takes longer than the period (await in it, or use run_sync), or the machine is busy"
                yield Problem("timer-late", text, fix, severity=Severity.WARNING)


def _nodes(ends: Sequence[EndView]) -> str:
    return ", ".join(dict.fromkeys(end.node for end in ends))
