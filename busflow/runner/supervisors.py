"""Supervisors of a graph's nodes: made, each with those that it waits for, found, and stopped in order."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from busflow import timeouts
from busflow.bus.names import absolute_name
from busflow.clock import Clock, perf_counter
from busflow.errors import NotRunning
from busflow.node.node import Node
from busflow.node.supervision import stop_order
from busflow.runner.supervisor import Overseer, Prerequisite, Supervisor
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.runner.extension import Extension
    from busflow.runner.planning.planned_node import PlannedNode


def supervisors_of(
    nodes: Sequence[PlannedNode],
    overseer: Overseer,
    extensions: Sequence[Extension] = (),
    beside: Sequence[Supervisor] = (),
) -> list[Supervisor]:
    """Make a supervisor for each node. It may wait for the others, those `beside`, and what the extensions have.

    A name that is found nowhere is that of a program that takes no part, as on simulated time: nothing waits for it.
    """
    supervisors = [Supervisor(each, overseer) for each in nodes]
    others = (each for extension in extensions for each in extension.prerequisites())
    by_name: dict[str, Prerequisite] = {each.name: each for each in (*others, *beside, *supervisors)}
    for supervisor in supervisors:
        needs = supervisor.supervision.depends_on.items()
        supervisor.needs = [(by_name[name], condition) for name, condition in needs if name in by_name]
        for other, condition in supervisor.needs:
            other.condition_event(condition)  # created now: the first message is observed only from here on
    return supervisors


def node_among(supervisors: Sequence[Supervisor], which: type[Node] | str) -> Node:
    """Return the node of a class, or of a name; relative names are below `/`.

    Raises:
        NotRunning: there is none, or more than one of the class.
    """
    if isinstance(which, str):
        full = absolute_name(which)
        found = [each.node for each in supervisors if each.name == full]
    else:
        found = [each.node for each in supervisors if isinstance(each.node, which)]
    shown = which if isinstance(which, str) else which.__name__
    names = [each.name for each in supervisors]
    if not found:
        raise NotRunning(f"there is no node {shown} in this graph; {did_you_mean(shown, names, none='it has none')}")
    if len(found) > 1:
        raise NotRunning(f"{len(found)} nodes are a {shown}; ask for one by name: {', '.join(names)}")
    return found[0]


async def stop_in_order(supervisors: Sequence[Supervisor], clock: Clock, grace_s: float) -> None:
    """Stop nodes, the last one first; none is given up before the grace of all has passed."""
    end = perf_counter() + grace_s
    by_name = {each.name: each for each in supervisors}
    order = stop_order(list(by_name), {each.name: each.supervision.depends_on for each in supervisors})
    for left, supervisor in zip(range(len(order), 0, -1), map(by_name.__getitem__, order), strict=True):
        supervisor.ask_to_stop()
        if supervisor.ends_at_once:  # waiting takes turns of the loop, which are long where many nodes run
            continue
        # A slow node costs the others the order of stopping, not their own stop().
        with clock.wall_timeout((end - perf_counter()) / left):
            await supervisor.ended.wait()
    for supervisor in [each for each in supervisors if not each.ended.is_set()]:
        with clock.wall_timeout(end - perf_counter()):
            await supervisor.ended.wait()
    late = [each for each in supervisors if not each.ended.is_set()]
    for supervisor in late:
        supervisor.give_up(grace_s)
    for resort in (Supervisor.close_tasks, Supervisor.leave):
        with clock.wall_timeout(timeouts.current.last_resort):
            for supervisor in late:
                await supervisor.ended.wait()
        for supervisor in [each for each in late if not each.ended.is_set()]:
            resort(supervisor)
