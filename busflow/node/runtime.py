"""NodeRuntime: the private side of a node: what it declares and creates, from its declaration to its end."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING, Any, Protocol, TypeVar, cast

from busflow.bus import names
from busflow.bus.endpoint import Endpoint, Line, ServiceEndpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS, checked_qos
from busflow.bus.services.client import Client
from busflow.bus.services.server import RequestHandler, Server
from busflow.bus.statistics import NodeStatistics
from busflow.bus.subscription import MessageHandler, Subscription
from busflow.bus.timer import Missed, Timer, TimerHandler
from busflow.errors import BusflowError, InvalidDeclaration, NotRunning, Problem
from busflow.interfaces.message import Message
from busflow.log import Logger
from busflow.node.callbacks import EventHandler, ParameterHandler
from busflow.node.context import Rng, Surroundings
from busflow.node.declarations import (
    ClientDeclaration,
    ComposedDeclaration,
    Declaration,
    PublisherDeclaration,
    PullDeclaration,
    TimerDeclaration,
    checked_service_type,
)
from busflow.node.endpoints import NodeEndpoints
from busflow.node.handlers import Handler, ParametersRole, ServiceRole, SubscriptionRole, declarations_of
from busflow.node.lifetime import NodeLifetime
from busflow.node.parameter_events import ParameterEvents
from busflow.node.parameter_store import Holder, ParameterStore, SetResult
from busflow.node.parameters import Parameters
from busflow.text import did_you_mean

if TYPE_CHECKING:
    from fractions import Fraction

    from busflow.bus.bus import Bus
    from busflow.clock import Clock

M = TypeVar("M", bound=Message)


class Declarer(Holder, Protocol):
    """The members of a node that its runtime uses."""

    def declare(self) -> None:
        """Create the endpoints and timers that depend on parameters."""
        ...


class NodeRuntime:
    """One node, from declaration to the end."""

    def __init__(self, node: Declarer, name: str) -> None:
        self.node: Any = node
        self.name = name
        self.full_name: str = names.fully_qualified(name, "/")  # raises for an invalid name
        """The name with its namespace, from `declare` on."""
        self.life: NodeLifetime = NodeLifetime(type(node).__name__, self.full_name, self.close)
        self.endpoints: NodeEndpoints = NodeEndpoints(self.life)
        self.parameters: ParameterStore = ParameterStore(node, self.full_name)
        self.parameter_events: ParameterEvents
        """Exists from `declare` on."""
        self.used_remaps: set[str] = set()
        self.doubts: list[Problem] = []
        """Warnings of what `declare` has read; the check before the start reports them."""
        self.on_connect: list[Callable[[Bus], None]] = []
        """Called with the bus once the endpoints are connected to it."""
        self._surroundings: Surroundings | None = None
        self._bus: Bus | None = None
        self._parameter_handlers: list[ParameterHandler] = []
        self._ended = False

    @property
    def surroundings(self) -> Surroundings:
        """The node's surroundings, once it is part of a graph."""
        if self._surroundings is None:
            raise NotRunning(
                f"{self.name} is not part of a graph yet: what __init__ would do belongs in declare() or start(); "
                "see busflow.launch, or busflow.testing"
            )
        return self._surroundings

    @cached_property
    def clock(self) -> Clock:
        """The run's clock."""
        return self.surroundings.clock

    @cached_property
    def log(self) -> Logger:
        """The run's log, bound to this node."""
        return self.surroundings.log.bind(self.full_name)

    @cached_property
    def rng(self) -> Rng:
        """The node's own generator."""
        return Rng(self.surroundings.seed, self.full_name, self.surroundings.life)

    def declare(self, surroundings: Surroundings) -> None:
        """Give the node its surroundings and create what it declares; nothing is connected yet."""
        if self._surroundings is not None:
            raise NotRunning(f"{self.full_name} is part of a graph already; make a new instance for another one")
        self._surroundings = surroundings
        self.full_name = self.parameters.node = names.fully_qualified(self.name, surroundings.namespace)
        self.life.be_called(self.full_name, self.log)
        self.parameters.stated = surroundings.parameter_source
        self.parameter_events = ParameterEvents(self.parameters, self.create_publisher, surroundings.clock, self.log)
        for attribute, declaration in declarations_of(self.node.__class__).items():
            try:
                endpoint = self._create(declaration)
            except BusflowError as error:
                error.place = error.place or declaration.place
                raise
            if endpoint is not None:
                vars(self.node)[attribute] = endpoint
        self.node.declare()
        self._check_listeners()

    def _check_listeners(self) -> None:
        topics = {each.topic for each in (*self.endpoints.publishers, *self.endpoints.subscriptions)}
        for listener in self.endpoints.listeners:
            if listener.topic not in topics:
                raise InvalidDeclaration(
                    f"{listener.origin} listens for events of {listener.topic}, which the node neither publishes nor "
                    f"receives; {did_you_mean(listener.topic, topics, none='declare it')}"
                )

    def _create(self, declared: Declaration) -> Any:
        """Create what is declared; return what the instance has in its place, or None."""
        origin, line = declared.origin, declared.written
        if isinstance(declared, PublisherDeclaration):
            return self.create_publisher(declared.type, declared.topic, declared.qos, origin=origin, line=line)
        if isinstance(declared, PullDeclaration):
            return self.create_subscription(declared.type, declared.topic, None, declared.qos, origin=origin, line=line)
        if isinstance(declared, ClientDeclaration):
            return self.create_client(declared.type, declared.service, origin=origin, line=line)
        if isinstance(declared, Handler):
            bound = declared.function.__get__(self.node)
            for role in declared.roles:
                if isinstance(role, SubscriptionRole):
                    message_type = declared.message_type()
                    self.create_subscription(message_type, role.topic, bound, role.qos, origin=origin, line=line)
                elif isinstance(role, ParametersRole):
                    self._parameter_handlers.append(ParameterHandler(bound, origin, self.life))
                elif isinstance(role, ServiceRole):
                    declared.check_service(role.type)
                    self.create_service(role.type, role.service, bound, depth=role.depth, origin=origin, line=line)
                else:
                    topic = self.resolve(role.topic).name
                    handler = EventHandler(topic, declared.event_type(), bound, origin, self.life)
                    self.endpoints.listeners.append(handler)
        if isinstance(declared, TimerDeclaration):
            bound = declared.function.__get__(self.node)
            period = declared.period(self.node.parameters)
            timer = self.create_timer(period, bound, name=declared.name, missed=declared.missed)
            if declared.parameter is not None:
                self.parameters.pace(timer, declared.parameter, declared.period)
            return timer
        if isinstance(declared, ComposedDeclaration):
            return cast("ComposedDeclaration[Any]", declared).compose(self.node)
        return None

    def create_publisher(
        self, message_type: type[M], topic: str, qos: QoS | None, *, origin: str, line: Line | None = None
    ) -> Publisher[M]:
        """Create a publisher; it is connected at once if the node is."""
        layers = self.surroundings.publisher_qos
        publisher = Publisher(message_type, self.endpoint(message_type, topic, qos, layers, origin, line))
        self.endpoints.add(publisher)
        return publisher

    def create_subscription(
        self,
        message_type: type[M],
        topic: str,
        handler: MessageHandler[M] | None,
        qos: QoS | None,
        *,
        origin: str,
        line: Line | None = None,
    ) -> Subscription[M]:
        """Create a subscription; it is connected at once if the node is."""
        if handler is not None and not callable(handler):  # type: ignore[redundant-expr]  # as below
            raise InvalidDeclaration(f"{origin} needs a method to call with each message, or none, not {handler!r}")
        layers = self.surroundings.subscription_qos
        endpoint = self.endpoint(message_type, topic, qos, layers, origin, line)
        subscription = Subscription(message_type, endpoint, handler)
        self.endpoints.add(subscription)
        return subscription

    def create_timer(self, period_s: float | Fraction, handler: TimerHandler, *, name: str, missed: Missed) -> Timer:
        """Create a timer; it ticks at once if the node has started."""
        self._refuse_after_the_end(f"timer {name}")
        timer = Timer(period_s, handler, name=name, node=self.full_name, missed=missed)
        self.endpoints.add(timer)
        return timer

    def create_service(
        self,
        service_type: Any,
        service: str,
        handler: RequestHandler[Any, Any],
        *,
        depth: int,
        origin: str,
        line: Line | None,
    ) -> Server[Any, Any]:
        """Create a server; it is connected at once if the node is."""
        endpoint = self.service_endpoint(service_type, service, origin, line)
        server = Server[Any, Any](endpoint.type, endpoint, handler, depth=depth)
        self.endpoints.add(server)
        return server

    def create_client(
        self, service_type: Any, service: str, *, origin: str, line: Line | None = None
    ) -> Client[Any, Any]:
        """Create a client; it is connected at once if the node is."""
        endpoint = self.service_endpoint(service_type, service, origin, line)
        client = Client[Any, Any](endpoint.type, endpoint)
        self.endpoints.add(client)
        return client

    def service_endpoint(self, service_type: Any, service: str, origin: str, line: Line | None) -> ServiceEndpoint:
        """Describe an end of a service, for a server or client that is made and added elsewhere."""
        checked = checked_service_type(service_type, origin)
        self._refuse_after_the_end(origin)
        resolved = self.resolve(service, service=True)
        return ServiceEndpoint(self.full_name, resolved.name, checked, origin, service, resolved.rule, line)

    def endpoint(
        self,
        message_type: type[M],
        topic: str,
        qos: QoS | None,
        layers: Callable[[str], tuple[QoS, ...]],
        origin: str,
        line: Line | None,
    ) -> Endpoint:
        """Return the description of an end of a topic, with the QoS that the launch file adds to the node's own."""
        if not (isinstance(message_type, type) and issubclass(message_type, Message)):  # type: ignore[redundant-expr]  # users without a type checker
            raise InvalidDeclaration(f"{origin} needs a message type before the topic's name, not {message_type!r}")
        self._refuse_after_the_end(origin)
        resolved = self.resolve(topic)
        own = checked_qos(qos, origin) or QoS()
        merged, stated = QoS.merge(own, *layers(resolved.name)), frozenset(own.model_fields_set)
        name = resolved.name
        return Endpoint(
            self.full_name, name, message_type, merged, origin, topic, resolved.rule, line=line, stated=stated
        )

    def _refuse_after_the_end(self, origin: str) -> None:
        if self._ended:
            raise NotRunning(f"{origin}: {self.full_name} has left its graph; it can create nothing more")

    def resolve(self, name: str, *, service: bool = False) -> names.Resolved:
        """Return the final name of a topic or service that the node calls `name`."""
        around = self.surroundings
        resolved = names.resolve(
            name, node=self.name, namespace=around.namespace, remaps=around.remaps, service=service
        )
        if resolved.rule is not None:
            self.used_remaps.add(resolved.rule)
        return resolved

    def connect(self, bus: Bus, predecessor: NodeRuntime | None = None) -> None:
        """Connect all endpoints to the bus, in place of a predecessor's; messages wait until `open`."""
        self._bus, self.life.dispatcher = bus, bus.dispatcher
        for observer in bus.observers:
            observer.parameters_added(self.parameters)
        self.parameters.on_change.append(self._on_parameters)
        self.endpoints.connect(bus, predecessor.endpoints.hand_over() if predecessor else None)
        for each in self.on_connect:
            each(bus)

    @property
    def bus(self) -> Bus:
        """The bus that the node is connected to."""
        if self._bus is None:
            raise NotRunning(f"{self.full_name} is not connected yet")
        return self._bus

    @property
    def is_busy(self) -> bool:
        """True if the node has anything left to do besides its `run`: to react, to answer, to serve late joiners."""
        return self.life.tasks > 0 or self.endpoints.keep_busy

    def statistics(self) -> NodeStatistics:
        """Return the current counts of the node's endpoints, tasks and parameters."""
        return NodeStatistics(
            node=self.full_name,
            publishers=tuple(each.statistics() for each in self.endpoints.publishers),
            subscriptions=tuple(each.statistics() for each in self.endpoints.subscriptions),
            servers=tuple(each.statistics() for each in self.endpoints.servers),
            clients=tuple(each.statistics() for each in self.endpoints.clients),
            timers=tuple(each.statistics() for each in self.endpoints.timers),
            tasks=self.life.tasks,
            parameters_set=self.parameters.times_set,
        )

    def open(self) -> None:
        """Start to deliver messages, answer requests and tick."""
        self.endpoints.open()
        self.parameter_events.open()
        for handler in self._parameter_handlers:
            handler.catch_up()

    def close(self) -> None:
        """Stop delivering, answering and ticking; new messages stay queued and counted, waiting calls fail at once."""
        self.endpoints.close()

    def end(self) -> None:
        """Refuse to create more; publishers and subscriptions stay attached, for a restart or for `disconnect`."""
        self._ended = True

    def discard_queued(self, reason: str) -> None:
        """Drop what its subscriptions have not handled, so that a later start begins with new messages."""
        for subscription in self.endpoints.subscriptions:
            subscription.discard_queued(reason)

    def disconnect(self) -> None:
        """Leave every topic and service; iterations over subscriptions end."""
        self.endpoints.leave()
        self._ended = True

    def _on_parameters(self, old: Parameters, result: SetResult) -> None:
        if self._bus is not None and not self._ended:
            self.parameter_events.publish(result.changed, self._bus)
        for handler in self._parameter_handlers:
            handler.on_change(old)
