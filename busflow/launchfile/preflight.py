"""Pre-flight: builds the nodes of a description without starting them, and finds everything that would go wrong.

All problems are collected into one report. What declares what is known from the nodes themselves, so a graph made
of classes and instances is checked exactly as one from a file, only without positions.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, TypeVar, cast

from busflow import parameter_events, plugins, rosout
from busflow.blame import blame
from busflow.compatibility import Verdict, compatibility
from busflow.errors import BusflowError, InvalidParameter, Place, PluginError, Problem, Severity
from busflow.launchfile.description import EndpointSpec, LaunchDescription, NodeSpec, TopicSpec
from busflow.launchfile.faults import parameter_problems
from busflow.launchfile.placement import as_seen_from, idle_places
from busflow.launchfile.supervision_checks import supervision_problems
from busflow.launchfile.value import Source
from busflow.message import type_name
from busflow.names import resolve
from busflow.node import Node, parameters_class, runtime_of
from busflow.parameter_store import ValueSource
from busflow.parameters import validate
from busflow.qos import QoS
from busflow.runtime import NodeRuntime
from busflow.supervision import Supervision
from busflow.surroundings import Surroundings
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from busflow.clock import Clock
    from busflow.endpoint import Endpoint, ServiceEndpoint
    from busflow.launchfile.value import Origin
    from busflow.log import Log

T = TypeVar("T")


@dataclass(frozen=True)
class Member:
    """One node of a graph that is built, and what the launch file says of it."""

    node: Node
    plugin: str
    spec: NodeSpec | None = None
    supervision: Supervision = field(default_factory=Supervision)

    @cached_property  # each check asks for it
    def runtime(self) -> NodeRuntime:
        """The node's endpoints."""
        return runtime_of(self.node)

    @property
    def place(self) -> Place | None:
        """Where the launch file names the node."""
        return self.spec.origin.place if self.spec else None

    @property
    def publishers(self) -> list[Endpoint]:
        """What the node publishes."""
        return [each.endpoint for each in self.runtime.publishers]

    @property
    def subscriptions(self) -> list[Endpoint]:
        """What the node receives."""
        return [each.endpoint for each in self.runtime.subscriptions]

    @property
    def servers(self) -> list[ServiceEndpoint]:
        """What the node answers."""
        return [each.endpoint for each in self.runtime.servers]

    @property
    def clients(self) -> list[ServiceEndpoint]:
        """What the node asks."""
        return [each.endpoint for each in self.runtime.clients]


@dataclass(slots=True)
class Plan:
    """The nodes of a graph, built and checked, ready to be started; or the problems that forbid it."""

    members: list[Member] = field(default_factory=list[Member])
    problems: list[Problem] = field(default_factory=list[Problem])

    @property
    def errors(self) -> list[Problem]:
        """The problems because of which the graph must not start."""
        return [problem for problem in self.problems if problem.severity is Severity.ERROR]


@dataclass(frozen=True, slots=True)
class Preflight:
    """What the nodes are built with, and how strict to be."""

    clock: Clock
    log: Log
    seed: int = 0
    strict: bool = False
    """Make a subscription whose topic nobody publishes an error."""

    def plan(
        self, descriptions: Sequence[LaunchDescription] = (), nodes: Sequence[tuple[Node, Supervision]] = ()
    ) -> Plan:
        """Build and check everything; the caller looks at `errors` before it starts anything."""
        plan = Plan()
        topics = [topic for description in descriptions for topic in description.topics]
        for description in descriptions:
            plan.problems += description.warnings
            for spec in description.nodes:
                told = len(plan.problems)
                self._add(plan, spec, topics)
                plan.problems[told:] = as_seen_from(description.here, spec, plan.problems[told:])
        for node, supervision in nodes:
            self._declare(plan, Member(node, type(node).__name__, None, supervision), topics)
        _announce_parameters(plan.members)
        plan.problems += _duplicate_names(plan.members)
        plan.problems += _type_conflicts(plan.members)
        plan.problems += _qos_conflicts(plan.members)
        for member in plan.members:
            plan.problems += _idle_specs(member)
        plan.problems += idle_places(descriptions)
        if len(plan.members) == len(nodes) + sum(len(each.nodes) for each in descriptions):
            # Of a node that could not be built nobody knows what it publishes: the others are not to blame.
            plan.problems += _idle_topic_specs(plan.members, topics)
            plan.problems += _one_ended_topics(plan.members, strict=self.strict)
            plan.problems += _service_problems(plan.members, strict=self.strict)
            plan.problems += supervision_problems(plan.members)
        return plan

    def _add(self, plan: Plan, spec: NodeSpec, topics: Sequence[TopicSpec]) -> None:
        """Load a node's plugin and build the node with its parameters."""
        try:
            node_class = plugins.load(spec.plugin, spec.folders)
        except PluginError as error:
            plan.problems.append(_at_plugin(error.problem, spec))
            return
        try:
            data = cast("Mapping[str, object]", spec.parameters.data)
            parameters = validate(parameters_class(node_class), data)
        except InvalidParameter as error:
            plan.problems += parameter_problems(error, spec)
            return
        except BusflowError as error:
            plan.problems.append(_in_code(error, str(error), spec.plugin_origin))
            return
        build: Callable[[], Node] = lambda: node_class(parameters, name=spec.name)  # noqa: E731  # guarded below
        node = _guarded(plan, spec, f"{spec.full_name} cannot be built", build)
        if node is not None:
            self._declare(plan, Member(node, spec.plugin, spec, spec.supervision), topics)

    def _declare(self, plan: Plan, member: Member, topics: Sequence[TopicSpec]) -> None:
        """Give a node its surroundings and let it declare its endpoints."""
        runtime, spec = member.runtime, member.spec
        stated = _layers(topics, (), runtime.name, "/")
        around = Surroundings(self.clock, self.log, self.seed, publisher_qos=stated, subscription_qos=stated)
        if spec is not None:
            around = replace(
                around,
                namespace=spec.namespace,
                remaps={rule.match: rule.replacement for rule in spec.remap},
                publisher_qos=_layers(topics, spec.publishers, spec.name, spec.namespace),
                subscription_qos=_layers(topics, spec.subscriptions, spec.name, spec.namespace),
                parameter_source=partial(_source, spec),
            )
        what = f"{runtime.name} cannot declare its endpoints"
        if _guarded(plan, spec, what, lambda: (runtime.declare(around), member)) is not None:
            plan.members.append(member)


def _guarded(plan: Plan, spec: NodeSpec | None, what: str, build: Callable[[], T]) -> T | None:
    """Run a plugin's own code; whatever it raises is a problem, with the line that raised it."""
    try:
        return build()
    except BusflowError as error:
        plan.problems.append(_in_code(error, f"{what}: {error}", spec.origin if spec else None))
    except (Exception, SystemExit) as error:  # noqa: BLE001  # a plugin may raise anything; it is told, not swallowed
        text = f"{what}: {type(error).__name__}: {error}"
        plan.problems.append(Problem("declaration", text, f"mend {type(error).__name__} there", blame(error)))
    return None


def _layers(
    topics: Sequence[TopicSpec], endpoints: Sequence[EndpointSpec], node: str, namespace: str
) -> Callable[[str], tuple[QoS, ...]]:
    """What the launch file states for an endpoint of a node: the topic's contract, then the node's own."""

    def stated(topic: str) -> tuple[QoS, ...]:
        own = [each.qos for each in endpoints if _expanded(each, node, namespace) == topic]
        return (*(each.qos for each in topics if each.topic == topic), *own)

    return stated


def _source(spec: NodeSpec, name: str) -> ValueSource | None:
    """Where the launch file, or what overrides it, states a parameter of a node."""
    found = spec.parameters.find(tuple(name.split(".")))
    if found is None:
        return None
    origin = found.origin
    return ValueSource(str(origin), origin.place if origin.source is Source.FILE else None)


def _announce_parameters(members: Sequence[Member]) -> None:
    """Where a node listens to changes of parameters, the others publish them from the start."""
    if any(endpoint.topic == parameter_events.TOPIC for member in members for endpoint in member.subscriptions):
        for member in members:
            member.runtime.parameter_events.declare()


def _duplicate_names(members: Sequence[Member]) -> Iterator[Problem]:
    seen: dict[str, Member] = {}
    for member in members:
        first = seen.setdefault(member.runtime.full_name, member)
        if first is not member:
            where = f", first at {first.place}" if first.place else ""
            yield _about(
                member,
                "duplicate-node",
                f"two nodes are called {member.runtime.full_name}{where}",
                "give one of them another name or namespace",
            )


def _type_conflicts(members: Sequence[Member]) -> Iterator[Problem]:
    """A topic carries one type: whoever came first has said which."""
    first: dict[str, Endpoint] = {}
    for member, endpoint in _endpoints(members):
        stated = first.setdefault(endpoint.topic, endpoint)
        if stated.type is not endpoint.type:
            yield _about(
                member,
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
                    yield _about(
                        member,
                        "qos-mismatch",
                        f"{requested.origin} of {requested.node} cannot receive {requested.topic} from "
                        f"{offered.node}: {'; '.join(found.reasons)}",
                        found.fix,
                    )


def _idle_topic_specs(members: Sequence[Member], topics: Sequence[TopicSpec]) -> Iterator[Problem]:
    """Entries under `topics:` that no endpoint has, or whose type is another one."""
    used = {endpoint.topic: endpoint for _, endpoint in _endpoints(members)}
    for spec in topics:
        endpoint = used.get(spec.topic)
        if endpoint is None:
            text = f"no node publishes or receives the topic {spec.topic}"
            yield _problem("unknown-topic", text, spec.origin, did_you_mean(spec.topic, used))
        elif spec.type is not None and spec.type not in _spellings(endpoint):
            actual = type_name(endpoint.type)
            text = f"the topic {spec.topic} carries {actual}, not {spec.type}"
            yield _problem("type-mismatch", text, spec.origin, f"write type: {actual}")


def _idle_specs(member: Member) -> Iterator[Problem]:
    """What the launch file says of a node's endpoints and that touches none of them."""
    spec = member.spec
    if spec is None:
        return
    for kind, stated, endpoints in (
        ("publish", spec.publishers, member.publishers),
        ("subscribe to", spec.subscriptions, member.subscriptions),
    ):
        topics = {endpoint.topic for endpoint in endpoints}
        for each in stated:
            if _expanded(each, spec.name, spec.namespace) not in topics:
                text = f"{spec.full_name} does not {kind} {each.topic}"
                known = topics | {endpoint.written for endpoint in endpoints}
                yield _problem("unknown-topic", text, each.origin, did_you_mean(each.topic, known))
    ends = (*member.publishers, *member.subscriptions, *member.servers, *member.clients)
    written = {endpoint.written for endpoint in ends}
    for rule in spec.remap:
        if rule.match not in member.runtime.used_remaps:
            text = f"the remap of {rule.match} matches no topic or service of {spec.full_name}"
            yield _problem("unused-remap", text, rule.origin, did_you_mean(rule.match, written))


def _one_ended_topics(members: Sequence[Member], *, strict: bool) -> Iterator[Problem]:
    published = {endpoint.topic for member in members for endpoint in member.publishers}
    received = {endpoint.topic for member in members for endpoint in member.subscriptions}
    for member in members:
        for endpoint in member.subscriptions:
            if endpoint.topic not in published and endpoint.topic != rosout.TOPIC:
                yield _about(
                    member,
                    "nobody-publishes",
                    f"{endpoint.origin} of {endpoint.node} receives {endpoint.topic}, which nobody publishes",
                    did_you_mean(endpoint.topic, published) if published else None,
                    Severity.ERROR if strict else Severity.WARNING,
                )
        for endpoint in member.publishers:
            if endpoint.topic not in received:
                text = f"{endpoint.origin} of {endpoint.node} publishes {endpoint.topic}, which nobody receives"
                yield _about(member, "nobody-receives", text, None, Severity.INFO)


def _service_problems(members: Sequence[Member], *, strict: bool) -> Iterator[Problem]:
    """Services of two types, of two servers, or of none."""
    stated: dict[str, ServiceEndpoint] = {}
    served: dict[str, ServiceEndpoint] = {}
    for member in members:
        for endpoint in (*member.servers, *member.clients):
            first = stated.setdefault(endpoint.service, endpoint)
            if first.type is not endpoint.type:
                text = f"{endpoint.origin} uses the service {endpoint.service} as {type_name(endpoint.type)}, but "
                text += f"{first.origin} uses it as {type_name(first.type)}"
                yield _about(member, "type-mismatch", text, _rename(endpoint, "use one type on both ends"))
        for endpoint in member.servers:
            first = served.setdefault(endpoint.service, endpoint)
            if first is not endpoint:
                text = f"{endpoint.origin} of {endpoint.node} answers {endpoint.service}, which {first.origin} of "
                yield _about(member, "two-servers", f"{text}{first.node} answers already", _rename(endpoint))
    for member in members:
        for endpoint in member.clients:
            if endpoint.service not in served:
                text = f"{endpoint.origin} of {endpoint.node} calls {endpoint.service}, which nobody answers"
                severity = Severity.ERROR if strict else Severity.WARNING
                yield _about(member, "nobody-answers", text, did_you_mean(endpoint.service, served), severity)


def _rename(endpoint: ServiceEndpoint, otherwise: str = "") -> str:
    renaming = f"remap one of them: remap: {{{endpoint.written}: another_name}}"
    return f"{otherwise}, or {renaming}" if otherwise else renaming


def _endpoints(members: Sequence[Member]) -> Iterator[tuple[Member, Endpoint]]:
    for member in members:
        for endpoint in (*member.publishers, *member.subscriptions):
            yield member, endpoint


def _expanded(spec: EndpointSpec, node: str, namespace: str) -> str:
    return resolve(spec.topic, node=node, namespace=namespace, remaps={}).name


def _spellings(endpoint: Endpoint) -> tuple[str, str]:
    """Both ways to write a message type: `pkg/msg/Type` and `pkg/Type`."""
    full = type_name(endpoint.type)
    return full, full.replace("/msg/", "/")


def _about(member: Member, code: str, message: str, fix: str | None, severity: Severity = Severity.ERROR) -> Problem:
    """A problem at the place where the launch file names the node."""
    return _problem(code, message, member.spec.origin if member.spec else None, fix, severity)


def _problem(
    code: str,
    message: str,
    origin: Origin | None,
    fix: str | None = None,
    severity: Severity = Severity.ERROR,
) -> Problem:
    if origin is None:
        return Problem(code, message, fix, severity=severity)
    return Problem(code, message, fix, origin.place, severity, origin.included_from)


def _in_code(error: BusflowError, text: str, origin: Origin | None) -> Problem:
    """A node that declares what cannot be: at the line of its code, or where the launch file names it."""
    place, text = error.place or blame(error), text.splitlines()[0]  # more lines only show where in a name it is
    if place is None:
        return _problem("declaration", text, origin)
    named = (origin.place, *origin.included_from) if origin is not None and origin.place is not None else ()
    return Problem("declaration", text, None, place, included_from=named)


def _at_plugin(problem: Problem, spec: NodeSpec) -> Problem:
    """A plugin's own problem keeps its line of code; one that has none gets the launch file's."""
    origin = spec.plugin_origin
    if problem.place is None:
        return replace(problem, place=origin.place, included_from=origin.included_from)
    return problem if origin.place is None else replace(problem, included_from=(*problem.included_from, origin.place))
