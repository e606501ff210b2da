"""Host: the program around a graph, as a node that publishes, subscribes and calls services on its bus."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar, cast

from busflow.bus.bus import Bus
from busflow.bus.names import expand
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.bus.services.call import Pair, Req, Res
from busflow.bus.services.client import Client
from busflow.bus.subscription import Subscription
from busflow.errors import IncompatibleType, NoSuchTarget
from busflow.interfaces.message import Message, type_name
from busflow.node.context import Surroundings
from busflow.node.declarations import checked_name, checked_type
from busflow.node.node import Node, runtime_of
from busflow.node.runtime import NodeRuntime
from busflow.text import did_you_mean, nearest

if TYPE_CHECKING:
    from busflow.actions.client import ActionClient
    from busflow.actions.goal import F, G, Parts, R

M = TypeVar("M", bound=Message)


class _Outside(Node):
    """The node that owns the program's endpoints."""


class Outside:
    """The program around a graph that runs."""

    def __init__(self, bus: Bus, surroundings: Surroundings) -> None:
        self._bus = bus
        self._surroundings = surroundings
        self._runtime: NodeRuntime | None = None
        self._publishers: dict[str, Publisher[Any]] = {}
        self._action_clients: dict[str, ActionClient[Any]] = {}
        self._clients: dict[str, Client[Any, Any]] = {}

    def publish(self, topic: str, message: Message) -> None:
        """Publish a message from any thread, as a publisher with the topic's default QoS."""
        try:
            publisher = self._publishers.get(topic)
        except TypeError:  # a message in the topic's place has no hash
            publisher = None
        if publisher is None:  # whichever thread comes first, the publisher is made on the loop's
            publisher = self._bus.call(lambda: self._publisher(type(message), topic))
        publisher.publish(message)

    def _publisher(self, message_type: type[M], topic: str) -> Publisher[M]:
        topic = checked_name(topic, "graph.publish(topic, message)", "topic")
        if not issubclass(message_type, Message):  # type: ignore[redundant-expr]  # users without a type checker
            given = message_type.__name__
            raise IncompatibleType(f"publish({topic!r}, …) takes a message, such as Float64(data=1.0), not a {given}")
        if topic not in self._publishers:
            self._refuse_misspelt(message_type, topic)
            self._publishers[topic] = self.advertise(message_type, topic)
        return self._publishers[topic]

    def advertise(self, message_type: type[M], topic: str, *, qos: QoS | None = None) -> Publisher[M]:
        """Create a publisher of the program."""
        return self._own().create_publisher(message_type, topic, qos, origin="Graph.advertise")

    def subscribe(self, message_type: type[M], topic: str, *, qos: QoS | None = None) -> Subscription[M]:
        """Create a subscription of the program, to pull from."""
        self._refuse_misspelt(checked_type(message_type, "graph.subscribe(Type, topic)"), topic)
        return self._own().create_subscription(message_type, topic, None, qos, origin="Graph.subscribe")

    def _refuse_misspelt(self, message_type: type[Message], topic: str) -> None:
        """Refuse an unknown topic whose name is like that of a known one; one like no other may be new on purpose.

        Raises:
            NoSuchTarget: the message has the nearest name.
        """
        name, topics = expand(topic, node="_outside", namespace="/"), self._bus.topics
        if name not in topics and nearest(name, topics) is not None:
            anyway = f'graph.advertise({message_type.__name__}, "{topic}") creates it all the same'
            raise NoSuchTarget(f"no node has the topic {name}; {did_you_mean(name, topics)} ({anyway})")

    def client(self, service_type: type[Pair[Req, Res]], service: str) -> Client[Req, Res]:
        """Return the program's client of a service."""
        client = self._clients.get(service)
        if client is None:
            client = self._clients[service] = self._own().create_client(service_type, service, origin="Graph.call")
        wanted = cast("Any", service_type)
        if client.type is not wanted:
            raise IncompatibleType(f"{client.service} is a {type_name(client.type)}, not a {type_name(wanted)}")
        return client

    def action_client(self, action_type: type[Parts[G, R, F]], action: str) -> ActionClient[Parts[G, R, F]]:
        """Return the program's client of an action."""
        from busflow.actions.declarations import action_client, create_client  # most runs have no action

        client = self._action_clients.get(action)
        if client is None:
            declared = action_client(action_type, action)
            declared.owner, declared.name = "Graph", "outside"
            client = self._action_clients[action] = create_client(declared, self._own())
            client.endpoints.feedback.open()  # the program has no start to wait for
        wanted = cast("Any", action_type)
        if client.type is not wanted:
            raise IncompatibleType(f"{client.action} is a {client.type.__ros_name__}, not a {wanted.__ros_name__}")
        return client

    def close(self) -> None:
        """Detach the program from every topic and service."""
        if self._runtime is not None:
            self._runtime.disconnect()

    def _own(self) -> NodeRuntime:
        """Return the program's runtime, created on first use: most programs need none."""
        if self._runtime is None:
            self._runtime = runtime_of(_Outside(name="_outside"))
            self._runtime.declare(self._surroundings)
            self._runtime.connect(self._bus)
        return self._runtime
