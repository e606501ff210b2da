"""`Preflight`: builds the nodes of a graph without starting them, and finds what would go wrong.

All problems are collected into one report. The endpoints are read from the nodes themselves, so a graph made of classes
and instances is checked exactly like one from a file, only without positions.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias, TypeVar, cast

from busflow.bus.endpoint import PARAMETER_EVENTS
from busflow.bus.qos import QoS
from busflow.errors import BusflowError, InvalidParameter, LaunchError, Place, PluginError, Problem, Severity
from busflow.launchfile.model.description import EndpointSpec, LaunchDescription, NodeSpec, TopicSpec
from busflow.launchfile.model.doubts import Doubt
from busflow.launchfile.model.placement import for_machine, unused_places
from busflow.launchfile.model.problems import in_order, parameter_problems, problem_at
from busflow.launchfile.model.supervision import Supervision
from busflow.launchfile.yaml.value import Origin, StatedBy
from busflow.node import plugins
from busflow.node.context import Surroundings
from busflow.node.factory import NodeFactory
from busflow.node.node import NO_INIT, Node
from busflow.node.parameter_store import ValueSource
from busflow.runner.planning.endpoints import conflicts, unmatched_ends, unused_entries
from busflow.runner.planning.planned_node import PlannedNode
from busflow.runner.planning.programs import program_problems
from busflow.runner.planning.supervision import supervision_problems
from busflow.validation.tracebacks import user_line

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.log import Log

T = TypeVar("T")
_StatedQoS: TypeAlias = Callable[[str], tuple[QoS, ...]]


@dataclass(slots=True)
class Plan:
    """Nodes of a graph, built and checked, and the problems found; without errors they are ready to start."""

    nodes: list[PlannedNode] = field(default_factory=list[PlannedNode])
    problems: list[Problem] = field(default_factory=list[Problem])
    is_whole: bool = True
    """Whether every node of the graph is among them, with its right name."""
    strict: bool = False
    """Whether what a node doubts is an error."""

    @property
    def errors(self) -> list[Problem]:
        """Problems that prevent the graph from starting."""
        return [problem for problem in self.problems if problem.severity is Severity.ERROR]


@dataclass(frozen=True, slots=True)
class Preflight:
    """Pre-flight check: the clock, log and seed that nodes are built with, and its strictness."""

    clock: Clock
    log: Log
    seed: int = 0
    strict: bool = False
    """Report a subscription without publisher, a client without server, and what a node doubts, as errors."""

    def plan(
        self, descriptions: Sequence[LaunchDescription] = (), nodes: Sequence[tuple[Node, Supervision]] = ()
    ) -> Plan:
        """Build and check everything. The caller checks `errors` before it starts anything."""
        plan = Plan(strict=self.strict)
        topics = [topic for description in descriptions for topic in description.topics]
        stated = partial(_qos_of_topic, topics)
        around = Surroundings(self.clock, self.log, self.seed, publisher_qos=stated, subscription_qos=stated)
        for description in descriptions:
            plan.problems += description.warnings
            own = replace(around, packages=description.packages)
            for spec in description.nodes:
                start = len(plan.problems)
                _plan_node(plan, spec, own, description.doubts)
                plan.problems[start:] = for_machine(description.here, spec, plan.problems[start:])
        for node, supervision in nodes:
            _declare(plan, PlannedNode(node, type(node).__name__, None, supervision), around)
        _announce_parameters(plan.nodes)
        doubts = frozenset[Doubt]().union(*(each.doubts for each in descriptions))
        plan.problems += conflicts(plan.nodes, topics, qos=Doubt.QOS not in doubts)
        for planned in plan.nodes:
            plan.problems += unused_entries(planned)
        plan.problems += program_problems(descriptions, simulated=self.clock.kind == "sim")
        if Doubt.NODES not in doubts:
            plan.problems += unused_places(descriptions)
        number = len(nodes) + sum(len(each.nodes) for each in descriptions)
        plan.is_whole = len(plan.nodes) == number and Doubt.NODES not in doubts
        if plan.is_whole:
            # With a node missing, the others may only seem to be unmatched.
            plan.problems += unmatched_ends(plan.nodes, topics, strict=self.strict)
            if Doubt.PROGRAMS not in doubts:
                plan.problems += supervision_problems(
                    plan.nodes, [one for each in descriptions for one in each.programs]
                )
        plan.problems = in_order(plan.problems, [str(file) for each in descriptions for file in each.files])
        return plan


def _plan_node(plan: Plan, spec: NodeSpec, around: Surroundings, doubts: frozenset[Doubt]) -> None:
    """Load a node's plugin, build the node with its parameters and add it to the plan, or what prevents that."""
    try:
        node_class = plugins.load(spec.plugin, spec.folders)
    except PluginError as error:
        if error.problem.code != "unknown-plugin" or Doubt.PLUGINS not in doubts:
            plan.problems.append(_at_plugin(error.problem, spec))
        return
    factory = NodeFactory(node_class, spec.name)
    try:
        parameters = factory.parameters(cast("Mapping[str, object]", spec.parameters.data))
    except BusflowError as error:
        refused = error if isinstance(error, InvalidParameter) else error.__cause__
        if refused is not error:
            plan.problems.append(_in_code(error, str(error), spec.plugin_origin))
        if isinstance(refused, InvalidParameter):
            faults = [each for each in refused.faults if each.code != "missing" or Doubt.PARAMETERS not in doubts]
            plan.problems += parameter_problems(InvalidParameter(faults), spec)
            _plan_without_faults(plan, spec, factory, refused, around)
        return
    node = _guarded(plan, spec, f"{spec.full_name} cannot be built", partial(factory.build, parameters))
    if node is not None:
        _declare(plan, PlannedNode(node, spec.plugin, spec, spec.supervision), around)


def _plan_without_faults(
    plan: Plan, spec: NodeSpec, factory: NodeFactory, error: InvalidParameter, around: Surroundings
) -> None:
    """Add a node without its wrong parameters, to check its endpoints, unless these may depend on them."""
    if factory.node_class.declare is not Node.declare or factory.node_class.__init__ is not Node.__init__:
        return
    right = spec.parameters.without_any(fault.path for fault in error.faults)
    try:
        parameters = factory.parameters(cast("Mapping[str, object]", right.data))
    except BusflowError:
        return
    aside = Plan()  # whose problems are dropped: they may come only from the missing parameters
    node = _guarded(aside, spec, "", partial(factory.build, parameters))
    if node is not None:
        _declare(aside, PlannedNode(node, spec.plugin, spec, spec.supervision), around)
    plan.nodes += aside.nodes


def _declare(plan: Plan, planned: PlannedNode, around: Surroundings) -> None:
    """Give a node its surroundings and let it declare its endpoints."""
    runtime, spec = planned.runtime, planned.spec
    if spec is not None:
        around = replace(
            around,
            namespace=spec.namespace,
            remaps={rule.match: rule.replacement for rule in spec.remap},
            publisher_qos=_with_own(around.publisher_qos, spec, spec.publishers),
            subscription_qos=_with_own(around.subscription_qos, spec, spec.subscriptions),
            parameter_source=partial(_value_source, spec),
            folder=spec.folder,
        )
    what = f"{runtime.name} cannot declare its endpoints"
    if _guarded(plan, spec, what, lambda: (runtime.declare(around), planned)) is not None:
        plan.nodes.append(planned)
        severity = Severity.ERROR if plan.strict else Severity.WARNING
        plan.problems += [replace(each, severity=severity) for each in runtime.doubts]


def _guarded(plan: Plan, spec: NodeSpec | None, what: str, build: Callable[[], T]) -> T | None:
    """Run a plugin's own code; any exception becomes a problem, with the line that raised it."""
    try:
        return build()
    except LaunchError as error:  # of a file that the node reads before the start, with a place of its own
        plan.problems += error.problems
    except BusflowError as error:
        plan.problems.append(_in_code(error, f"{what}: {error}", spec.origin if spec else None))
    except (Exception, SystemExit) as error:  # noqa: BLE001  # a plugin may raise anything; it becomes a problem
        plan.problems.append(problem_in_code(error, what, spec.plugin_origin.place if spec else None))
    return None


def problem_in_code(error: BaseException, what: str, origin: Place | None = None) -> Problem:
    """Return the problem of an exception in a plugin's own code, at the line that raised it, or else at `origin`."""
    from busflow.validation.advice import advice, close_unawaited  # here, as it is needed for errors alone

    close_unawaited(error)
    place = user_line(error)
    fix = advice(error) or f"correct the line that raises {type(error).__name__}" if place is not None else NO_INIT
    return Problem("declaration", f"{what}: {type(error).__name__}: {error}", fix, place or origin)


def _qos_of_topic(topics: Sequence[TopicSpec], topic: str) -> tuple[QoS, ...]:
    """Return the QoS that the entries of a topic state."""
    return tuple(each.qos for each in topics if each.topic == topic)


def _with_own(shared: _StatedQoS, spec: NodeSpec, endpoints: Sequence[EndpointSpec]) -> _StatedQoS:
    """Return a function that gives the QoS stated for a topic: first the topic's own entry, then the node's."""

    def stated(topic: str) -> tuple[QoS, ...]:
        own = [each.qos for each in endpoints if each.full_topic(spec.name, spec.namespace) == topic]
        return (*shared(topic), *own)

    return stated


def _value_source(spec: NodeSpec, name: str) -> ValueSource | None:
    """Return the place where the launch file, or an override, states a parameter of a node."""
    found = spec.parameters.find(tuple(name.split(".")))
    if found is None:
        return None
    origin = found.origin
    return ValueSource(str(origin), origin.place if origin.source is StatedBy.FILE else None)


def _announce_parameters(nodes: Sequence[PlannedNode]) -> None:
    """Let all nodes publish their parameter changes from the start if a node of the graph receives them."""
    if any(endpoint.topic == PARAMETER_EVENTS for planned in nodes for endpoint in planned.subscriptions):
        for planned in nodes:
            planned.runtime.parameter_events.declare()


def _in_code(error: BusflowError, text: str, origin: Origin | None) -> Problem:
    """Return the problem of an invalid declaration, at its line of code, or where the launch file names the node."""
    place, text = error.place or user_line(error), text.splitlines()[0]  # further lines only mark a place in the name
    if place is None:
        return Problem("declaration", text, None) if origin is None else problem_at("declaration", text, None, origin)
    named = (origin.place, *origin.included_from) if origin is not None and origin.place is not None else ()
    return Problem("declaration", text, None, place, included_from=named)


def _at_plugin(problem: Problem, spec: NodeSpec) -> Problem:
    """Return a plugin's problem with its place in the launch file: as its place, or beside its line of code."""
    origin = spec.plugin_origin
    if problem.code == "unknown-plugin" and (folder := _unnamed_folder(spec)):
        problem = replace(problem, fix=f"its file is in a folder that this one does not name: add plugins: [{folder}]")
    if problem.place is None:
        return replace(problem, place=origin.place, included_from=origin.included_from)
    return problem if origin.place is None else replace(problem, included_from=(*problem.included_from, origin.place))


def _unnamed_folder(spec: NodeSpec) -> str | None:
    """Return a folder that holds a node's plugin but is missing in `plugins`, relative to the launch file."""
    place, file = spec.plugin_origin.place, f"{spec.plugin.partition(':')[0]}.py"
    beside = Path(place.file).parent if place is not None else Path()
    named = {each.resolve() for each in spec.folders}
    found = (each for each in ("plugins", "../plugins") if os.path.isfile(beside / each / file))  # noqa: PTH113  # never raises
    return next((each for each in found if (beside / each).resolve() not in named), None)
