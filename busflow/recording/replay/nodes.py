"""ReplayPlan: the nodes of a replay, with their recorded parameters."""

from __future__ import annotations

import json
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from busflow.bus.endpoint import PARAMETER_EVENTS, ROSOUT
from busflow.bus.names import absolute_name
from busflow.errors import BagError, PluginError
from busflow.launchfile.model.description import ClockSpec, LaunchDescription, NodeSpec
from busflow.launchfile.yaml.value import Origin, StatedBy, Value
from busflow.node import plugins
from busflow.node.factory import NodeFactory
from busflow.node.node import Node, parameters_class
from busflow.node.parameters import ParameterInfo, Parameters, describe, grouped, value_of
from busflow.runner.graph import What, described
from busflow.runner.planning.preflight import PlannedNode, Preflight
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.log import Log

Recorded = Mapping[str, Mapping[str, object]]
"""By a node's full name, its parameters when the recording began."""

_RECORDED = Origin(StatedBy.CALLER)
OF_THE_RUN = {PARAMETER_EVENTS, ROSOUT}
"""Topics that the run itself publishes, for its nodes; they are not compared."""


@dataclass(slots=True)
class ReplayPlan:
    """The nodes that run again, and facts about the others."""

    what: list[What] = field(default_factory=list[What])
    others_publish: set[str] = field(default_factory=set[str])
    """Topics on which the other nodes of the launch files publish, which do not run in the replay."""
    notes: list[str] = field(default_factory=list[str])
    """The limits of the replay, as lines for people."""


def replay_plan(
    what: Sequence[What],
    nodes: Collection[str],
    recorded: Recorded,
    *,
    args: Mapping[str, object] | None,
    clock: Clock,
    log: Log,
) -> ReplayPlan:
    """Return the named nodes of the launch files (all if none is named), and the node classes and instances.

    Raises:
        BagError: No launch file has a node of that name.
        LaunchError: A launch file cannot be read.
        InvalidParameter: A recorded value is not valid for the parameter of a class any more.
    """
    plan = ReplayPlan()
    files = [described(each, args) for each in what if isinstance(each, str | Path | LaunchDescription)]
    wanted = {absolute_name(name) for name in nodes}
    known = [spec.full_name for description in files for spec in description.nodes]
    for name in sorted(wanted - set(known)):
        one = files[0].files[0] if len(files) == 1 and files[0].files else None
        owner = f"{one} has no" if one is not None else "no launch file has a"
        raise BagError(f"{owner} node {name}", fix=did_you_mean(name, known, none="name a launch file that has nodes"))
    for description in files:
        chosen = [spec for spec in description.nodes if not wanted or spec.full_name in wanted]
        planned = Preflight(clock, log).plan([description]).nodes
        plan.notes += _overruled(planned, {spec.full_name for spec in chosen}, recorded)
        names = {spec.full_name for spec in chosen}
        plan.others_publish |= set(_published(each for each in planned if each.runtime.full_name not in names))
        used = set(_topics(each for each in planned if each.runtime.full_name in names))
        plan.what.append(
            replace(
                description,
                nodes=tuple(_with_recorded(spec, names, recorded, plan) for spec in chosen),
                topics=tuple(each for each in description.topics if each.topic in used),
                clock=ClockSpec(),
                processes=(),
                warnings=(),
            )
        )
    plan.what += [_built(each, recorded, plan) for each in what if not isinstance(each, str | Path | LaunchDescription)]
    return plan


def _overruled(nodes: Iterable[PlannedNode], names: Collection[str], recorded: Recorded) -> Iterator[str]:
    """Yield a note for each value of a launch file or argument that gives way to another, recorded value."""
    for each in nodes:
        spec, values = each.spec, recorded.get(each.runtime.full_name, {})
        if spec is None or spec.full_name not in names:
            continue
        parameters: Parameters = each.node.parameters
        for info in describe(type(parameters)):
            stated = spec.parameters.find(tuple(info.name.split(".")))
            if stated is None or info.name not in values:
                continue
            then, now = plain(values[info.name], info), value_of(parameters, info.name)
            if then != now:
                yield f"{spec.full_name} has {info.name} = {then!r}, as recorded, and not {now!r} ({stated.origin})"


def _published(nodes: Iterator[PlannedNode]) -> Iterator[str]:
    yield from (end.topic for each in nodes for end in each.publishers if end.topic not in OF_THE_RUN)


def _topics(nodes: Iterator[PlannedNode]) -> Iterator[str]:
    yield from (end.topic for each in nodes for end in (*each.publishers, *each.subscriptions))


def _with_recorded(spec: NodeSpec, names: Collection[str], recorded: Recorded, plan: ReplayPlan) -> NodeSpec:
    """Return a file's node with its recorded parameters; it waits only for nodes that run in the replay too."""
    needs = {name: each for name, each in spec.supervision.depends_on.items() if name in names}
    spec = replace(spec, supervision=replace(spec.supervision, depends_on=needs), process=None)
    values = recorded.get(spec.full_name)
    if values is None:
        return spec
    try:
        cls = plugins.load(spec.plugin, spec.folders)
    except PluginError:
        return spec  # it is reported, with its place, when the graph is planned
    data = _nested_values(values, cls, spec.full_name, plan)
    return replace(spec, parameters=spec.parameters.merged(Value.of(data, _RECORDED)))


def _built(what: Any, recorded: Recorded, plan: ReplayPlan) -> What:
    """Return a class's node with its recorded parameters; return an instance as it is, with its own parameters."""
    if not (isinstance(what, type) and issubclass(what, Node)):
        return cast("What", what)
    factory = NodeFactory(what)
    values = _nested_values(recorded.get(f"/{factory.name}", {}), factory.node_class, factory.name, plan)
    return factory.build(factory.parameters(values))


def _nested_values(values: Mapping[str, object], cls: type[Node], node: str, plan: ReplayPlan) -> dict[str, object]:
    """Return the recorded values, nested as in a launch file; note and omit parameters that no longer exist."""
    infos = {info.name: info for info in describe(parameters_class(cls))}
    for name in (each for each in values if each not in infos):
        plan.notes.append(f"{node} had a parameter {name} when it was recorded, and has no such parameter now")
    return grouped({name: plain(value, infos[name]) for name, value in values.items() if name in infos})


def plain(value: object, info: ParameterInfo) -> object:
    """Return a recorded value in the parameter's own type: a type that ROS 2 lacks was recorded as JSON.

    >>> plain('{"a": 1}', ParameterInfo("limits", "dict[str, int]")), plain("a", ParameterInfo("name", "str"))
    ({'a': 1}, 'a')
    """
    if isinstance(value, str) and info.type.startswith(("dict", "list", "object")):
        try:
            return json.loads(value)
        except ValueError:
            return value
    return value
