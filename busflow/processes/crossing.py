"""Crossing: finds topics and services that cannot go from one process to another, before the start."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from busflow.bus.qos import Overflow
from busflow.errors import BusflowError, Problem
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import type_name
from busflow.launchfile.model.placement import Placement

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint, ServiceEndpoint
    from busflow.launchfile.check.planned_node import PlannedNode
    from busflow.launchfile.check.preflight import Plan


def crossing_problems(plan: Plan, placement: Placement) -> Iterator[Problem]:
    """Find what works within one process but not between the processes in which these nodes are placed."""
    if not (placement.others or placement.elsewhere):
        return
    where = {member.runtime.full_name: placement.process_of(member.runtime.full_name) for member in plan.members}
    reported: set[type[Any]] = set()
    for member, end, other in _pairs(plan.members, where):
        if end.type not in reported and (why := _uncodable(end.type)):
            reported.add(end.type)
            text = f"{type_name(end.type)} cannot go from the process {where[other.node]} to {where[end.node]}: {why}"
            yield _problem(member, "cannot-cross", text, f"put {other.node} and {end.node} into one process")
    for member in plan.members:
        for other in member.supervision.depends_on:
            if where.get(other, where[member.runtime.full_name]) != where[member.runtime.full_name]:
                text = f"{member.runtime.full_name} depends on {other}, which is in another process"
                fix = "put both into one process, or leave it out: no process starts before all are linked"
                yield _problem(member, "cannot-depend", text, fix)
        for received in member.subscriptions:
            if received.qos.overflow is Overflow.BLOCK:
                yield from _unblockable(member, received, plan.members, where)


def _pairs(
    members: Sequence[PlannedNode], where: dict[str, str]
) -> Iterator[tuple[PlannedNode, Endpoint | ServiceEndpoint, Endpoint | ServiceEndpoint]]:
    """Pair each subscription and client with each publisher or server in another process that it uses."""
    for member in members:
        for received in member.subscriptions:
            for other in members:
                for published in other.publishers:
                    if published.topic == received.topic and where[published.node] != where[received.node]:
                        yield member, received, published
        for asking in member.clients:
            for other in members:
                for server in other.servers:
                    if server.service == asking.service and where[server.node] != where[asking.node]:
                        yield member, asking, server


def _uncodable(cls: type[Any]) -> str:
    """Return why messages of a type cannot be encoded; empty where they can."""
    try:
        support = TypeSupport(cls)
        parts = (cls.Request, cls.Response) if hasattr(cls, "Request") else (cls,)
        _ = support.type_hash, [TypeSupport(part).encode for part in parts]
    except BusflowError as error:
        return str(error)
    except Exception as error:  # noqa: BLE001  # a type of the user's own may fail in any way: it is reported
        return f"{type(error).__name__}: {error}"
    return ""


def _unblockable(
    member: PlannedNode, received: Endpoint, members: Sequence[PlannedNode], where: dict[str, str]
) -> Iterator[Problem]:
    """Report publishers in other processes, which cannot wait for a full queue here."""
    here = where[received.node]
    far = [
        published.node
        for other in members
        for published in other.publishers
        if published.topic == received.topic and where[published.node] != here
    ]
    if far:
        text = f"{received.origin} receives {received.topic} with overflow: block, and {', '.join(far)} in another "
        text += "process cannot wait for it: what finds no room would be lost"
        fix = f"put them into one process (process: {here}), or give it a deep queue that drops its oldest"
        yield _problem(member, "cannot-block", text, fix)


def _problem(member: PlannedNode, code: str, text: str, fix: str) -> Problem:
    origin = member.spec.origin if member.spec else None
    return Problem(
        code, text, fix, origin.place if origin else None, included_from=origin.included_from if origin else ()
    )


def keep_main(plan: Plan, placement: Placement) -> None:
    """Leave in a plan only what runs in the main process of this machine."""
    plan.members = [each for each in plan.members if placement.process_of(each.runtime.full_name) == placement.main]
