"""ServiceEvents: publishes a service's calls as ROS 2's service introspection does, while another process listens.

The process of the server publishes one event for each received request, and one for each answer that it has sent. It
makes no events while no process subscribes to the service's event topic.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.errors import BusflowError
from busflow.runner.service_events import SUFFIX, event_class, event_message, is_elsewhere

if TYPE_CHECKING:
    from busflow.bus.services.call import Call
    from busflow.bus.services.service import Service
    from busflow.wire.mirror.connection import Connection
    from busflow.wire.zenoh.keys import Token

_QOS = QoS(depth=1000)


class ServiceEvents:
    """The event topics of this process's services."""

    def __init__(self, connection: Connection) -> None:
        self._bus, self._log = connection.bus, connection.log
        self._listeners: dict[str, set[str]] = {}
        """By service, the tokens of event subscriptions in other processes."""
        self._published: dict[str, tuple[Publisher[Any], Callable[[Call[Any, Any]], None]]] = {}
        """By service, the publisher of its events and the tap that calls it."""

    def on_token(self, text: str, token: Token, *, alive: bool) -> None:
        """Handle a subscription to an event topic that has come or gone."""
        name = token.topic.removesuffix(SUFFIX)
        listeners = self._listeners.setdefault(name, set())
        if alive:
            listeners.add(text)
            self.offer(name)
        else:
            listeners.discard(text)
        if not listeners:
            del self._listeners[name]
            self._end(name)

    def offer(self, name: str) -> None:
        """Publish a service's events from now on, if another process subscribes and this process has the service."""
        service = self._bus.services.get(name)
        if service is None or name in self._published or name not in self._listeners:
            return
        cls, topic = event_class(service.type), name + SUFFIX
        node = name.rpartition("/")[0] if service.server is None else service.server.node
        publisher: Publisher[Any] = Publisher(cls, Endpoint(node, topic, cls, _QOS, f"the events of {name}", topic))
        try:
            self._bus.attach_publisher(publisher)
        except BusflowError as error:
            self._log.warning(f"the calls of {name} are not published: {error}")
            return
        tap = partial(self._publish, service, publisher, set())
        service.taps.append(tap)
        self._published[name] = publisher, tap

    def _publish(
        self, service: Service[Any, Any], publisher: Publisher[Any], elsewhere: set[int], call: Call[Any, Any]
    ) -> None:
        if is_elsewhere(call, service, elsewhere):
            return
        message = event_message(publisher.type, call, self._bus.clock.now())
        if message is not None:
            publisher.publish(message)

    def _end(self, name: str) -> None:
        if name in self._published:
            publisher, tap = self._published.pop(name)
            self._bus.services[name].taps.remove(tap)
            publisher.close()
