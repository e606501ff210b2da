"""Questions: a run's knowledge about itself as plain data. Each method answers one query of other processes."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, cast

from busflow.bus.publisher import Publisher
from busflow.bus.subscription import Subscription
from busflow.errors import NoSuchTarget
from busflow.interfaces.message import ServiceType, type_name
from busflow.node.parameter_messages import type_of
from busflow.runner.by_hand import Order, OrdersByHand
from busflow.runner.service_events import event_class
from busflow.text import did_you_mean, quoted
from busflow.wire.queries.kept_messages import KeptMessages
from busflow.wire.queries.logger_services import LoggerServices
from busflow.wire.queries.logs import DEPTH, LogBook, ParameterLog
from busflow.wire.queries.meter import Meters
from busflow.wire.queries.parameter_services import ParameterServices
from busflow.wire.queries.server import Question, WithMessages
from busflow.wire.zenoh.keys import Attachment

if TYPE_CHECKING:
    from busflow.bus.endpoint import Endpoint
    from busflow.bus.topic import Receiver, Topic, TopicPublisher
    from busflow.definitions.library import Library
    from busflow.interfaces.encoding.foreign import ForeignType
    from busflow.interfaces.encoding.typesupport import TypeSupport
    from busflow.node.parameter_store import LiveParameter
    from busflow.runner.graph import Graph
    from busflow.runner.supervisor import Supervisor
    from busflow.wire.zenoh.run_directory import RunCard

_NO_GID = bytes(16)


class Supports(Protocol):
    """A function that returns the type support of a message class."""

    def __call__(self, cls: type[Any]) -> TypeSupport:
        """Return the type support of this class."""
        ...


class Questions:
    """The answers of one process; every method takes a query's arguments."""

    def __init__(
        self,
        graph: Graph,
        card: RunCard,
        process: str,
        supports: Supports,
        history: KeptMessages,
        elsewhere: Collection[str],
        about: Callable[[], Mapping[str, Any]],
    ) -> None:
        """Create the answers about a graph.

        Args:
            graph: the nodes of this process.
            card: the run's description of itself.
            process: this process's name.
            supports: returns the type support of a message class.
            history: the messages that are kept for `--last`.
            elsewhere: the tokens of other processes.
            about: what else `run` answers: `restarts`, or of the main process `members`, what it knows of the others.
        """
        self._graph, self._card, self._process = graph, card, process
        self._supports, self._history = supports, history
        self._elsewhere, self._about = elsewhere, about
        self._is_for_ros2 = card.ros2_domain is not None
        self.parameter_log: ParameterLog = ParameterLog(graph.clock)
        self.left_topics: set[str] = set()
        """Topics of nodes that left while the graph ran; not shown while they have no endpoint."""
        self._log_book = LogBook()
        graph.log.sinks.append(self._log_book.write)
        self._orders = OrdersByHand(graph)
        self._meters = Meters(graph.bus, lambda topic: lambda message: len(supports(topic.type).encode(message)))

    @cached_property
    def _library(self) -> Library:
        """The types of the definition files that the launch files name."""
        from busflow.definitions.library import Library  # a run whose types are all classes never needs it

        return Library(self._folders)

    @property
    def _folders(self) -> list[Path]:
        return [folder.path.absolute() for each in self._graph.descriptions for folder in each.interfaces]

    def close(self) -> None:
        """Remove all meters, carry out no more orders, and keep no more log lines."""
        self._meters.close()
        self._orders.close()
        self._graph.log.sinks.remove(self._log_book.write)

    def all(self) -> Mapping[str, Question]:
        """Return each question's name and its method."""
        return {
            "run": self.run,
            "report": self.report,
            "graph": self.graph,
            "types": self.types,
            "services": self.services,
            "history": self.history,
            "measure": self.measure,
            "parameters": self.parameters,
            "set_parameters": self.set_parameters,
            "order_nodes": self.order_nodes,
            "parameter_changes": self.parameter_changes,
            "log": self.log,
            "snapshot": self.snapshot,
        }

    def run(self, _arguments: Mapping[str, Any]) -> object:
        """Return the run: `{name, pid, since_ns, file, version, process, seed, clock, elapsed_s, nodes, states, …}`.

        `interfaces` are its folders of definition files; the main process adds what it knows of the others.
        """
        graph = self._graph
        return asdict(self._card) | {
            "process": self._process,
            "pid": os.getpid(),
            "seed": graph.seed,
            "clock": graph.clock.kind,
            "elapsed_s": graph.clock.seconds(),
            "nodes": len(graph.supervisors),
            "states": Counter(each.state.value for each in graph.supervisors),
            "interfaces": [str(each) for each in self._folders],
            **self._facts(),
            **self._about(),
        }

    def report(self, _arguments: Mapping[str, Any]) -> object:
        """Return the report in the form of `--report`, as it stands now."""
        return self._graph.report().as_json()

    def graph(self, _arguments: Mapping[str, Any]) -> object:
        """Return `{process, pid, elapsed_s, clock, inbox, nodes, topics, services, timers, elsewhere, …}`."""
        graph, inbox, services = self._graph, self._graph.bus.inbox.statistics(), self._graph.bus.services
        timers = [asdict(timer.statistics()) for each in graph.supervisors for timer in each.runtime.endpoints.timers]
        external = {each.topic for spec in self._graph.descriptions for each in spec.topics if each.external}
        return {
            "process": self._process,
            "pid": os.getpid(),
            "elapsed_s": self._graph.clock.seconds(),
            "clock": self._graph.clock.kind,
            "inbox": {"dropped": inbox.dropped, "refused": inbox.refused},
            "nodes": [_node(each) for each in self._graph.supervisors],
            "topics": [
                self._topic(topic, external)
                for topic in graph.bus.topics.values()
                if topic.publishers or topic.subscriptions or topic.name not in self.left_topics
            ],
            "services": [services[name].statistics().as_json() for name in sorted(services)],
            "timers": timers,
            "elsewhere": sorted(self._elsewhere),
            **self._facts(),
        }

    def _facts(self) -> dict[str, Any]:
        """Return what the graph's extensions say of themselves, such as its `programs`."""
        return {name: fact for each in self._graph.course.extensions for name, fact in each.about().items()}

    def types(self, arguments: Mapping[str, Any]) -> object:
        """Return `{hash, encoding, description}` by type name; `names` or a `hash` select types."""
        wanted, type_hash = arguments.get("names"), arguments.get("hash")
        if not (wanted is None or isinstance(wanted, list)):
            raise ValueError("names is a list of type names")
        supports = [self._supports(topic.type) for topic in self._graph.bus.topics.values()]
        chosen = (each for each in supports if type_hash is None or each.type_hash == type_hash)
        found = {each.name: _described(each) for each in chosen if wanted is None or each.name in wanted}
        names = [str(name) for name in cast("list[object]", wanted or [])]
        defined = (name for name in names if name not in found and name in self._library)
        foreign = (self._library.foreign(name) for name in defined)
        return found | {each.name: _described(each) for each in foreign if type_hash in (None, each.type_hash)}

    def services(self, arguments: Mapping[str, Any]) -> object:
        """Return `{type, hash, request, response}` by service name, the last two as in `types`; `names` limits them.

        With `events` there is also `event`, the type in which the calls are published; None for the services that
        every node has.
        """
        wanted = arguments.get("names")
        services = self._graph.bus.services
        accounts = {name: service.statistics() for name, service in services.items()}
        types: dict[str, type[ServiceType]] = {name: service.type for name, service in services.items()}
        for supervisor in self._graph.supervisors:
            own = LoggerServices(self._graph.log, supervisor.name).all()
            offered = [*ParameterServices(supervisor.runtime.parameters, is_for_ros2=self._is_for_ros2).all(), *own]
            if self._is_for_ros2:
                from busflow.wire.queries.type_services import TypeServices  # as in wire/mirror/services.py

                offered += TypeServices(self._graph.bus, self._supports, supervisor.name).all()
            types |= {name: service_type for name, service_type, _ in offered}
        return {
            name: {
                "type": type_name(service_type),
                "hash": self._supports(service_type).type_hash,
                "request": _described(self._supports(service_type.Request)),
                "response": _described(self._supports(service_type.Response)),
                "event": self._event(service_type) if name in accounts and arguments.get("events") else None,
                "servers": [asdict(each) for each in accounts[name].servers] if name in accounts else [],
                "clients": [asdict(each) for each in accounts[name].clients] if name in accounts else [],
            }
            for name, service_type in types.items()
            if wanted is None or name in wanted
        }

    def _event(self, service_type: type[ServiceType]) -> Mapping[str, Any]:
        return _described(self._supports(event_class(service_type)))

    def history(self, arguments: Mapping[str, Any]) -> object:
        """Return the last `count` messages of `topic`, oldest first, how many are kept, and their type."""
        topic = self._named(arguments["topic"])
        support = self._supports(topic.type)
        messages = self._history.last(topic, int(arguments.get("count", 1)))
        first = topic.published - len(messages) + 1
        replies = [
            (support.encode(message), Attachment(first + place, 0, _NO_GID).encode())
            for place, message in enumerate(messages)
        ]
        state = {"type": support.name, "depth": self._history.depth(topic.name), "published": topic.published}
        return WithMessages(state | {"count": len(replies)} | _described(support), replies)

    def measure(self, arguments: Mapping[str, Any]) -> object:
        """Return the traffic of `topic` since this `reader` last asked, with or without `sizes`, and its ledger."""
        topic = self._named(arguments["topic"])
        found = self._meters.read(str(arguments["reader"]), topic, sizes=bool(arguments.get("sizes")))
        return found | {"subscriptions": [asdict(each.statistics()) for each in topic.subscriptions]}

    def log(self, arguments: Mapping[str, Any]) -> object:
        """Return the last `count` log lines, oldest first, of `node` or of all, from `level` (a number) on."""
        level, node = int(arguments.get("level", 0)), arguments.get("node")
        lines = self._log_book.last(int(arguments.get("count", DEPTH)), node=node, level=level)
        found = {"lines": [asdict(line) for line in lines], "written": self._log_book.written, "kept": DEPTH}
        return found | {"process": self._process}

    def snapshot(self, arguments: Mapping[str, Any]) -> object:
        """Begin to write the last moments of the run for a `reason`: its entry in the report, `path` among it."""
        return asdict(self._graph.snapshot(str(arguments["reason"])))

    def parameters(self, arguments: Mapping[str, Any]) -> object:
        """Return each node's parameters: value, type (`ros_type` is ROS 2's number), range, source; `node` is one."""
        wanted = arguments.get("node")
        return {
            supervisor.name: [_parameter(each) for each in supervisor.runtime.parameters.describe()]
            for supervisor in self._graph.supervisors
            if wanted is None or supervisor.name == wanted
        }

    def set_parameters(self, arguments: Mapping[str, Any]) -> object:
        """Set `values` of a `node`, all or none: `{changed: [{name, old, new}], faults: [{path, message, fix}]}`."""
        for supervisor in self._graph.supervisors:
            if supervisor.name == arguments["node"]:
                return asdict(supervisor.runtime.parameters.set(arguments["values"]))
        raise NoSuchTarget(f"there is no node {quoted(arguments['node'])} in this process")

    def order_nodes(self, arguments: Mapping[str, Any]) -> object:
        """Begin to `start`, `stop` or `restart` (the `order`) these `nodes`; return them as `graph` shows them now."""
        supervisors = self._orders.give(Order(arguments["order"]), set(map(str, arguments["nodes"])))
        return {each.name: _node(each) for each in supervisors}

    def parameter_changes(self, arguments: Mapping[str, Any]) -> object:
        """Return the changes after the number `since` gives for this process; without it the last number."""
        since = arguments.get("since")
        number = None if since is None else int(since.get(self._process, 0))
        return {"process": self._process} | self.parameter_log.since(number)

    def _named(self, name: str) -> Topic[Any]:
        topics = self._graph.bus.topics
        found = topics.get(name)
        if found is None:
            raise NoSuchTarget(f"there is no topic {quoted(name)}; {did_you_mean(name, topics)}")
        return found

    def _topic(self, topic: Topic[Any], external: Collection[str]) -> dict[str, Any]:
        support = self._supports(topic.type)
        return {
            "name": topic.name,
            "type": support.name,
            "hash": support.type_hash,
            "encoding": support.encoding,
            "published": topic.published,
            "kept": self._history.depth(topic.name),
            "external": topic.name in external,
            "publishers": [_publisher(each) for each in topic.publishers],
            "subscriptions": [_subscription(each) for each in topic.subscriptions],
            "gone": [asdict(each) for each in topic.gone],
            "losses": dict(topic.losses),
        }


def _described(support: TypeSupport | ForeignType) -> dict[str, Any]:
    return {"hash": support.type_hash, "encoding": support.encoding, "description": support.description}


def _node(supervisor: Supervisor) -> dict[str, Any]:
    return {
        "name": supervisor.name,
        "plugin": supervisor.plugin,
        "state": supervisor.state.value,
        "restarts": supervisor.restarts,
        "stopped_by_hand": supervisor.stopped_by_hand,
        "started_by_hand": supervisor.started_by_hand,
        "depends_on": sorted(supervisor.supervision.depends_on),
        "failure_count": supervisor.failure_count,
        "failures": [supervisor.failure.summary] if supervisor.failure else [],
        "publishers": _names(supervisor.runtime.endpoints.publishers),
        "subscriptions": _names(supervisor.runtime.endpoints.subscriptions),
    }


def _names(ends: Sequence[Publisher[Any] | Subscription[Any]]) -> list[dict[str, str]]:
    return [{"topic": end.topic, "type": type_name(end.type)} for end in ends]


def _publisher(publisher: TopicPublisher) -> dict[str, Any]:
    return _endpoint(publisher.endpoint) | {"published": publisher.published}


def _subscription(subscription: Receiver) -> dict[str, Any]:
    remark = getattr(subscription, "remark", "")  # of a subscription that a package above the bus has made
    return _endpoint(subscription.endpoint) | asdict(subscription.statistics()) | ({"remark": remark} if remark else {})


def _endpoint(endpoint: Endpoint) -> dict[str, Any]:
    return {
        "node": endpoint.node,
        "qos": endpoint.qos.model_dump(mode="json"),
        "origin": endpoint.origin,
        "written": endpoint.written,
    }


def _parameter(parameter: LiveParameter) -> dict[str, Any]:
    info, place = parameter.info, parameter.source.place
    return asdict(info) | {
        "bounds": info.bounds._asdict(),
        "range": str(info.bounds),
        "ros_type": type_of(info.default if parameter.value is None else parameter.value, info),
        "value": parameter.value,
        "source": parameter.source.text,
        "at": None if place is None else str(place),
    }
