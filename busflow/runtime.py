"""NodeRuntime: everything behind a node's one private name. Its endpoints, its tasks, and where failures go."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from inspect import iscoroutinefunction
from typing import TYPE_CHECKING, Any, TypeVar

import anyio
import anyio.abc
import numpy as np
from structlog.typing import FilteringBoundLogger

from busflow import names
from busflow.declarations import Declaration, PublisherDeclaration, PullDeclaration, TimerDeclaration
from busflow.endpoint import Endpoint
from busflow.errors import InvalidDeclaration, NotRunning
from busflow.events import Event
from busflow.failure import Failure, is_failure, refuse_coroutine
from busflow.handlers import Handler, ParametersRole, SubscriptionRole
from busflow.inheritance import declarations_of
from busflow.message import Message
from busflow.parameter_events import ParameterEvents
from busflow.parameter_handler import ParameterHandler
from busflow.parameter_store import ParameterStore, SetResult, ValueSource
from busflow.parameters import Parameters
from busflow.publishers import Publisher
from busflow.qos import QoS
from busflow.subscriptions import MessageHandler, Subscription
from busflow.text import did_you_mean
from busflow.timers import Missed, Timer, TimerHandler

if TYPE_CHECKING:
    from fractions import Fraction

    from busflow.bus import Bus
    from busflow.clock import Clock
    from busflow.log import Log
    from busflow.node import Node

M = TypeVar("M", bound=Message)


class Rng(np.random.Generator):
    """A numpy generator that can go back to where it began."""

    def __init__(self, seed: int, name: str) -> None:
        """The generator of one node: of the run's seed and the node's full name."""
        super().__init__(np.random.PCG64(np.random.SeedSequence(seed, spawn_key=tuple(name.encode()))))
        self._beginning = self.bit_generator.state

    def reseed(self) -> None:
        """Start the sequence over."""
        self.bit_generator.state = self._beginning


@dataclass(frozen=True, slots=True)
class Listener:
    """One `@on_event` of a node."""

    topic: str
    event_type: type[Event]
    handler: Callable[[Any], Any]
    origin: str


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What a node is given from outside: names, overrides, and the run's clock, log and seed."""

    clock: Clock
    log: Log
    seed: int = 0
    namespace: str = "/"
    remaps: Mapping[str, str] = field(default_factory=dict[str, str])
    publisher_qos: Callable[[str], tuple[QoS, ...]] = lambda _topic: ()
    """By final topic name, the layers of QoS that the launch file states for a publisher of this node."""
    subscription_qos: Callable[[str], tuple[QoS, ...]] = lambda _topic: ()
    parameter_source: Callable[[str], ValueSource | None] = lambda _name: None
    """By dotted name, where the launch file or the command line states a parameter of this node."""


class NodeRuntime:
    """One node's endpoints and tasks, from declaration to the end."""

    def __init__(self, node: Node, name: str) -> None:
        names.check_node_name(name)
        self.node = node
        self.name = name
        self.publishers: list[Publisher[Any]] = []
        self.subscriptions: list[Subscription[Any]] = []
        self.timers: list[Timer] = []
        self.parameters = ParameterStore(self)
        self.parameter_events = ParameterEvents(self)
        self.used_remaps: set[str] = set()
        self.on_failure: Callable[[Failure], None] | None = None
        self._surroundings: Surroundings | None = None
        self._bus: Bus | None = None
        self._tasks: anyio.abc.TaskGroup | None = None
        self._listeners: list[Listener] = []
        self._parameter_handlers: list[ParameterHandler] = []
        self._open = False
        self._ended = False

    @property
    def full_name(self) -> str:
        """The node's name with its namespace."""
        namespace = self._surroundings.namespace if self._surroundings else "/"
        return names.fully_qualified(self.name, namespace)

    @property
    def surroundings(self) -> Surroundings:
        """What the node was given, once it is part of a graph."""
        if self._surroundings is None:
            raise NotRunning(f"{self.name} is not part of a graph yet; see busflow.launch, or busflow.testing")
        return self._surroundings

    @property
    def is_open(self) -> bool:
        """Whether messages are handed over and timers tick."""
        return self._open

    @cached_property
    def log(self) -> FilteringBoundLogger:
        """The run's log, bound to this node."""
        return self.surroundings.log.bind(self.full_name)

    @cached_property
    def rng(self) -> Rng:
        """The node's own generator."""
        return Rng(self.surroundings.seed, self.full_name)

    def declare(self, surroundings: Surroundings) -> None:
        """Give the node its surroundings and create what it declares; nothing is connected yet."""
        if self._surroundings is not None:
            raise NotRunning(f"{self.full_name} is part of a graph already; make a new instance for another one")
        self._surroundings = surroundings
        self.parameters.stated = surroundings.parameter_source
        for attribute, declaration in declarations_of(type(self.node)).items():
            endpoint = self._create(declaration)
            if endpoint is not None:
                vars(self.node)[attribute] = endpoint
        self.node.declare()
        self._check_listeners()

    def _check_listeners(self) -> None:
        topics = {each.topic for each in (*self.publishers, *self.subscriptions)}
        for listener in self._listeners:
            if listener.topic not in topics:
                raise InvalidDeclaration(
                    f"{listener.origin} listens for events of {listener.topic}, which the node neither publishes nor "
                    f"receives; {did_you_mean(listener.topic, topics)}"
                )

    def _create(self, declared: Declaration) -> Publisher[Any] | Subscription[Any] | Timer | None:
        origin = declared.origin
        if isinstance(declared, PublisherDeclaration):
            return self.create_publisher(declared.type, declared.topic, declared.qos, origin=origin)
        if isinstance(declared, PullDeclaration):
            return self.create_subscription(declared.type, declared.topic, None, declared.qos, origin=origin)
        if isinstance(declared, Handler):
            bound = declared.function.__get__(self.node)
            for role in declared.roles:
                if isinstance(role, SubscriptionRole):
                    self.create_subscription(declared.message_type(), role.topic, bound, role.qos, origin=origin)
                elif isinstance(role, ParametersRole):
                    self._parameter_handlers.append(ParameterHandler(bound, origin, self))
                else:
                    topic = self._resolve(role.topic).name
                    self._listeners.append(Listener(topic, declared.event_type(), bound, origin))
        if isinstance(declared, TimerDeclaration):
            bound = declared.function.__get__(self.node)
            period = declared.period(self.node.parameters)
            timer = self.create_timer(period, bound, name=declared.name, missed=declared.missed)
            if declared.parameter is not None:
                self.parameters.pace(timer, declared.parameter, declared.period)
            return timer
        return None

    def create_publisher(self, message_type: type[M], topic: str, qos: QoS | None, *, origin: str) -> Publisher[M]:
        """A publisher of this node, connected at once when the node is."""
        layers = self.surroundings.publisher_qos
        publisher = Publisher(message_type, self._endpoint(message_type, topic, qos, layers, origin))
        if self._bus is not None:
            self._connect_publisher(self._bus, publisher)
        self.publishers.append(publisher)
        return publisher

    def create_subscription(
        self,
        message_type: type[M],
        topic: str,
        handler: MessageHandler[M] | None,
        qos: QoS | None,
        *,
        origin: str,
    ) -> Subscription[M]:
        """A subscription of this node, connected at once when the node is."""
        layers = self.surroundings.subscription_qos
        endpoint = self._endpoint(message_type, topic, qos, layers, origin)
        subscription = Subscription(message_type, endpoint, handler)
        if self._bus is not None:
            self._connect_subscription(self._bus, subscription)
        self.subscriptions.append(subscription)
        if self._open:
            self._open_subscription(subscription)
        return subscription

    def create_timer(self, period_s: float | Fraction, handler: TimerHandler, *, name: str, missed: Missed) -> Timer:
        """A timer of this node, ticking at once when the node is started."""
        self._refuse_after_the_end(f"timer {name}")
        timer = Timer(period_s, handler, name=name, node=self.full_name, missed=missed)
        if self._bus is not None:
            self._connect_timer(self._bus, timer)
        self.timers.append(timer)
        if self._open:
            timer.open()
        return timer

    def _endpoint(
        self,
        message_type: type[M],
        topic: str,
        qos: QoS | None,
        layers: Callable[[str], tuple[QoS, ...]],
        origin: str,
    ) -> Endpoint:
        if not (isinstance(message_type, type) and issubclass(message_type, Message)):  # type: ignore[redundant-expr]  # users without a type checker
            raise InvalidDeclaration(f"{origin} needs a message type before the topic's name, not {message_type!r}")
        self._refuse_after_the_end(origin)
        resolved = self._resolve(topic)
        stated = () if qos is None else (qos,)
        merged = QoS.merge(*stated, *layers(resolved.name))
        return Endpoint(self.full_name, resolved.name, message_type, merged, origin, topic, resolved.rule)

    def _refuse_after_the_end(self, origin: str) -> None:
        if self._ended:
            raise NotRunning(f"{origin}: {self.full_name} has left its graph; it can create nothing more")

    def _resolve(self, topic: str) -> names.Resolved:
        around = self.surroundings
        resolved = names.resolve(topic, node=self.name, namespace=around.namespace, remaps=around.remaps)
        if resolved.rule is not None:
            self.used_remaps.add(resolved.rule)
        return resolved

    def connect(self, bus: Bus) -> None:
        """Connect every declared endpoint to the bus; messages wait until `open`."""
        self._bus = bus
        bus.attach_parameters(self.parameters)
        self.parameters.on_change.append(self._on_parameters)
        for publisher in self.publishers:
            self._connect_publisher(bus, publisher)
        for subscription in self.subscriptions:
            self._connect_subscription(bus, subscription)
        for timer in self.timers:
            self._connect_timer(bus, timer)

    def _connect_publisher(self, bus: Bus, publisher: Publisher[Any]) -> None:
        bus.attach_publisher(publisher)
        publisher.on_event = self._hear if self._listeners else None

    def _connect_subscription(self, bus: Bus, subscription: Subscription[Any]) -> None:
        subscription.on_event = self._hear if self._listeners else None
        origin = f"{subscription.endpoint.origin} (subscription {subscription.topic})"
        bus.attach_subscription(subscription, lambda error, message: self.fail(origin, error, message))

    def _connect_timer(self, bus: Bus, timer: Timer) -> None:
        origin = f"{type(self.node).__name__}.{timer.name} (timer)"
        bus.attach_timer(timer, self.spawn, lambda error: self.fail(origin, error))

    def adopt_tasks(self, tasks: anyio.abc.TaskGroup | None) -> None:
        """Run what the node spawns in this task group; without one it can spawn nothing."""
        self._tasks = tasks

    def open(self) -> None:
        """Begin to hand over messages, and to tick."""
        self._open = True
        for subscription in self.subscriptions:
            self._open_subscription(subscription)
        for timer in self.timers:
            timer.open()
        self.parameter_events.tell_all()
        for handler in self._parameter_handlers:
            handler.catch_up()

    def _open_subscription(self, subscription: Subscription[Any]) -> None:
        pump = subscription.open()
        if pump is not None:
            self.spawn(pump, subscription.endpoint.origin)

    def close(self) -> None:
        """Hand over and tick no more; what arrives waits and stays counted."""
        self._open = False
        for timer in self.timers:
            timer.close()
        for subscription in self.subscriptions:
            subscription.pause()

    def disconnect(self) -> None:
        """End what is iterated over and leave every topic."""
        for subscription in self.subscriptions:
            if self._bus is not None:
                self._bus.detach_subscription(subscription)
        for publisher in self.publishers:
            publisher.close()
        self._ended = True

    def _hear(self, event: Event) -> None:
        """Tell the node's listeners of an event, in a turn of the loop of their own."""
        for listener in self._listeners:
            if self._open and listener.topic == event.topic and isinstance(event, listener.event_type):
                asyncio.get_running_loop().call_soon(self._tell, listener, event)

    def _tell(self, listener: Listener, event: Event) -> None:
        if not self._open or self._bus is None:
            return
        if iscoroutinefunction(listener.handler):
            self.spawn(listener.handler(event), listener.origin)
            return
        try:
            self._bus.dispatcher.run_now(lambda: refuse_coroutine(listener.handler(event), listener.origin))
        except BaseException as error:  # noqa: BLE001  # a node may raise anything; whoever supervises it decides
            self.fail(f"{listener.origin} (event {event})", error)

    def _on_parameters(self, old: Parameters, result: SetResult) -> None:
        if self._bus is not None and not self._ended:
            self.parameter_events.tell(result.changed, self._bus)
        for handler in self._parameter_handlers:
            handler.tell(old)

    def run_now(self, callback: Callable[[], None]) -> None:
        """Call back into the node's code, and deliver what it publishes before returning."""
        if self._bus is not None:
            self._bus.dispatcher.run_now(callback)

    def spawn(self, coroutine: Coroutine[Any, Any, None], name: str) -> None:
        """Run a coroutine in the node's task group; its failure is the node's."""
        if self._tasks is None:
            coroutine.close()
            raise NotRunning(f"{self.full_name} has no tasks before its start() and from its stop() on")
        self._tasks.start_soon(self._guarded, coroutine, name, name=f"{self.full_name}.{name}")

    async def _guarded(self, coroutine: Coroutine[Any, Any, None], name: str) -> None:
        try:
            await coroutine
        except BaseException as error:
            if not is_failure(error):
                raise
            self.fail(f"{type(self.node).__name__} (task {name})", error)

    def fail(self, origin: str, error: BaseException, message: Message | None = None) -> None:
        """Tell whoever supervises the node that it raised; it is handed nothing more."""
        self.close()
        if self.on_failure is not None:
            self.on_failure(Failure(self.full_name, origin, error, message))
