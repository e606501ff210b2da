"""Revision: what an edited launch file changes in the graph that runs from it, and changing it."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from busflow.errors import InvalidParameter
from busflow.launchfile.check.member import Member
from busflow.launchfile.check.preflight import Plan
from busflow.launchfile.model.description import LaunchDescription
from busflow.node.node import parameters_class
from busflow.node.parameters import describe, value_of
from busflow.validation.faults import same

if TYPE_CHECKING:
    from busflow.runner.graph import Graph

_LATER = {"name": "name", "seed": "seed", "clock": "clock", "environment": "env", "shutdown_grace_s": "shutdown"}
"""What a run keeps as it began, and the key of the launch file that states it."""


@dataclass(frozen=True, slots=True)
class Revision:
    """What is different between two descriptions of one graph."""

    parameters: Mapping[str, Mapping[str, object]]
    """By node, the parameters that the file gives other values, and that the node can be told while it runs."""
    leaving: tuple[str, ...]
    """The nodes that are no longer there."""
    coming: tuple[Member, ...]
    """The nodes that were not there before."""
    restarting: tuple[Member, ...]
    """The nodes of which something else is different."""
    later: tuple[str, ...]
    """The keys whose change only another run will see."""

    def __bool__(self) -> bool:
        return any((self.parameters, self.leaving, self.coming, self.restarting, self.later))

    def told(self) -> dict[str, str]:
        """What is different, for the log."""
        parts = {
            "set": [f"{node} {name}" for node, changes in self.parameters.items() for name in changes],
            "stopped": self.leaving,
            "started": [member.runtime.full_name for member in self.coming],
            "restarted": [member.runtime.full_name for member in self.restarting],
        }
        return {key: ", ".join(names) for key, names in parts.items() if names}


def revision(old: LaunchDescription, before: Plan, new: LaunchDescription, after: Plan) -> Revision:
    """What is different, by the plans of both descriptions, of which neither has been started."""
    present = {member.runtime.full_name: member for member in before.members}
    parameters: dict[str, Mapping[str, object]] = {}
    coming: list[Member] = []
    restarting: list[Member] = []
    for member in after.members:
        former = present.pop(member.runtime.full_name, None)
        if former is None:
            coming.append(member)
            continue
        changes = dict(_changes(former, member))
        read_only = {info.name for info in describe(parameters_class(type(member.node))) if info.read_only}
        if _shape(former) != _shape(member) or read_only & changes.keys():
            restarting.append(member)
        elif changes:
            parameters[member.runtime.full_name] = changes
    later = (key for name, key in _LATER.items() if getattr(old, name) != getattr(new, name))
    return Revision(parameters, tuple(present), tuple(coming), tuple(restarting), tuple(later))


async def apply(revision: Revision, graph: Graph) -> None:
    """Change a running graph; what a node refuses is logged, and the rest is done all the same."""
    for name, changes in revision.parameters.items():
        try:
            graph.set_parameters(name, changes)
        except InvalidParameter as refused:
            graph.log.bind(name).error("the node refuses what its launch file says now", reason=str(refused))
    restarting = [member.runtime.full_name for member in revision.restarting]
    await graph.dismiss([*revision.leaving, *restarting])
    graph.admit([*revision.restarting, *revision.coming])


def _changes(former: Member, member: Member) -> Iterator[tuple[str, object]]:
    """The parameters whose values are different."""
    before, after = former.node.parameters, member.node.parameters
    for info in describe(parameters_class(type(member.node))) if type(former.node) is type(member.node) else ():
        if not same(value_of(before, info.name), value_of(after, info.name)):
            yield info.name, value_of(after, info.name)


def _shape(member: Member) -> Hashable:
    """Everything of a node that it cannot be told while it runs."""
    topics = [(end.topic, end.type, end.qos) for end in (*member.publishers, *member.subscriptions)]
    services = [(end.service, end.type) for end in (*member.servers, *member.clients)]
    spec = member.spec
    kept = (spec.plugin, [(rule.match, rule.replacement) for rule in spec.remap]) if spec is not None else None
    return repr((type(member.node), kept, member.supervision, topics, services))
