"""Conflicts: what nodes declare that cannot be together in one graph."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from busflow.bus.qos_matching import Verdict, compatibility
from busflow.interfaces.message import type_name

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint, ServiceEndpoint
    from busflow.errors import Problem
    from busflow.launchfile.check.member import Member


def conflicts(members: Sequence[Member], *, qos: bool = True) -> Iterator[Problem]:
    """Nodes of one name, and topics and services whose ends do not fit together; in `qos` too, where it is known."""
    yield from _duplicate_names(members)
    yield from _type_conflicts(members)
    if qos:
        yield from _qos_conflicts(members)
    yield from _service_conflicts(members)


def _duplicate_names(members: Sequence[Member]) -> Iterator[Problem]:
    seen: dict[str, Member] = {}
    for member in members:
        first = seen.setdefault(member.runtime.full_name, member)
        if first is not member:
            where = f", first at {first.place}" if first.place else ""
            yield member.problem(
                "duplicate-node",
                f"two nodes are called {member.runtime.full_name}{where}",
                "give one of them another name or namespace",
            )


def _type_conflicts(members: Sequence[Member]) -> Iterator[Problem]:
    """A topic carries one type: whoever came first has said which."""
    first: dict[str, Endpoint] = {}
    for member, endpoint in ((each, end) for each in members for end in (*each.publishers, *each.subscriptions)):
        stated = first.setdefault(endpoint.topic, endpoint)
        if stated.type is not endpoint.type:
            yield member.problem(
                "type-mismatch",
                f"{endpoint.origin} uses {endpoint.topic} as {type_name(endpoint.type)}, but {stated.origin} "
                f"uses it as {type_name(stated.type)}",
                f"use one type on both ends, or remap one of them: remap: {{{endpoint.written}: another_name}}",
            )


def _qos_conflicts(members: Sequence[Member]) -> Iterator[Problem]:
    offers: dict[str, list[Endpoint]] = defaultdict(list)
    for member in members:
        for endpoint in member.publishers:
            offers[endpoint.topic].append(endpoint)
    for member in members:
        for requested in member.subscriptions:
            for offered in offers[requested.topic]:
                found = compatibility(offered.qos, requested.qos)
                if found.verdict is Verdict.ERROR:
                    yield member.problem(
                        "qos-mismatch",
                        f"{requested.origin} of {requested.node} cannot receive {requested.topic} from "
                        f"{offered.node}: {'; '.join(found.reasons)}",
                        found.fix,
                    )


def _service_conflicts(members: Sequence[Member]) -> Iterator[Problem]:
    """A service has one type, and one server."""
    stated: dict[str, ServiceEndpoint] = {}
    served: dict[str, ServiceEndpoint] = {}
    for member in members:
        for endpoint in (*member.servers, *member.clients):
            first = stated.setdefault(endpoint.service, endpoint)
            if first.type is not endpoint.type:
                text = f"{endpoint.origin} uses the service {endpoint.service} as {type_name(endpoint.type)}, but "
                text += f"{first.origin} uses it as {type_name(first.type)}"
                yield member.problem("type-mismatch", text, _rename(endpoint, "use one type on both ends"))
        for endpoint in member.servers:
            first = served.setdefault(endpoint.service, endpoint)
            if first is not endpoint:
                text = f"{endpoint.origin} of {endpoint.node} answers {endpoint.service}, which {first.origin} of "
                yield member.problem("two-servers", f"{text}{first.node} answers already", _rename(endpoint))


def _rename(endpoint: ServiceEndpoint, otherwise: str = "") -> str:
    renaming = f"remap one of them: remap: {{{endpoint.written}: another_name}}"
    return f"{otherwise}, or {renaming}" if otherwise else renaming
