"""Crossing: before the start, finds topics and services that cannot work from one process to another."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from busflow.bus.qos import Overflow
from busflow.errors import BusflowError, Problem
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import type_name
from busflow.launchfile.model.placement import Placement
from busflow.launchfile.model.problems import problem_at

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint, ServiceEndpoint
    from busflow.runner.planning.planned_node import PlannedNode
    from busflow.runner.planning.preflight import Plan


def crossing_problems(plan: Plan, placement: Placement) -> Iterator[Problem]:
    """Find the problems that the nodes have in these processes, and would not have in a single one."""
    if not (placement.others or placement.elsewhere):
        return
    place = {planned.runtime.full_name: placement.process_of(planned.runtime.full_name) for planned in plan.nodes}
    reported: set[type[Any]] = set()
    for planned, end, other in _pairs(plan.nodes, place):
        if end.type not in reported and (why := _uncodable(end.type)):
            reported.add(end.type)
            text = f"{type_name(end.type)} cannot go from the process {place[other.node]} to {place[end.node]}: {why}"
            yield _problem(planned, "cannot-cross", text, f"put {other.node} and {end.node} into one process")
    yield from _dependencies_apart(plan.nodes, placement, place)
    for planned in plan.nodes:
        for received in planned.subscriptions:
            if received.qos.overflow is Overflow.BLOCK:
                yield from _unblockable(planned, received, plan.nodes, place)


def _dependencies_apart(
    nodes: Sequence[PlannedNode], placement: Placement, place: Mapping[str, str]
) -> Iterator[Problem]:
    """Report nodes and programs that depend on what is in another process, or is started by one."""
    programs = {each.name: process for process, specs in placement.programs.items() for each in specs}
    everywhere = {**place, **programs}
    for planned in nodes:
        name = planned.runtime.full_name
        for other in planned.supervision.depends_on:
            if everywhere.get(other, place[name]) != place[name]:
                text, fix = _apart(name, other, is_program=other in programs)
                yield _problem(planned, "cannot-depend", text, fix)
    for program in (each for specs in placement.programs.values() for each in specs):
        for other in program.supervision.depends_on:
            if everywhere.get(other, programs[program.name]) != programs[program.name]:
                text, fix = _apart(program.name, other, is_program=True)
                yield problem_at("cannot-depend", text, fix, program.depends_origins.get(other, program.origin))


def _apart(name: str, other: str, *, is_program: bool) -> tuple[str, str]:
    text = f"{name} depends on {other}, which is in another process"
    if is_program:
        return text, "leave it out, or put the node into the main process, which starts programs"
    return text, "put both into one process, or leave it out: no node starts before all processes are linked"


def _pairs(
    nodes: Sequence[PlannedNode], place: dict[str, str]
) -> Iterator[tuple[PlannedNode, Endpoint | ServiceEndpoint, Endpoint | ServiceEndpoint]]:
    """Pair each subscription and client with each publisher or server in another process that it uses."""
    for planned in nodes:
        for received in planned.subscriptions:
            for other in nodes:
                for published in other.publishers:
                    if published.topic == received.topic and place[published.node] != place[received.node]:
                        yield planned, received, published
        for client in planned.clients:
            for other in nodes:
                for server in other.servers:
                    if server.service == client.service and place[server.node] != place[client.node]:
                        yield planned, client, server


def _uncodable(cls: type[Any]) -> str:
    """Return why messages of a type cannot be encoded; empty if they can."""
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
    planned: PlannedNode, received: Endpoint, nodes: Sequence[PlannedNode], place: dict[str, str]
) -> Iterator[Problem]:
    """Report publishers in other processes: they cannot wait until a full queue of this subscription has room."""
    here = place[received.node]
    others = [
        published.node
        for other in nodes
        for published in other.publishers
        if published.topic == received.topic and place[published.node] != here
    ]
    if others:
        text = f"{received.origin} receives {received.topic} with overflow: block, and {', '.join(others)} in another "
        text += "process cannot wait for its queue: a message for which it has no room would be lost"
        fix = f"put them into one process (process: {here}), or give it a deep queue that drops its oldest"
        yield _problem(planned, "cannot-block", text, fix)


def _problem(planned: PlannedNode, code: str, text: str, fix: str) -> Problem:
    origin = planned.spec.origin if planned.spec else None
    return Problem(
        code, text, fix, origin.place if origin else None, included_from=origin.included_from if origin else ()
    )


def keep_main(plan: Plan, placement: Placement) -> None:
    """Remove from a plan all nodes but those of the main process of this machine."""
    plan.nodes = [each for each in plan.nodes if placement.process_of(each.runtime.full_name) == placement.main]
