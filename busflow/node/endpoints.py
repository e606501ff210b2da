"""NodeEndpoints: the endpoints and timers of one node, from their declaration on.

They are connected to the bus before the node's `start`, opened after it, closed before its `stop`, and leave after
that. After a restart, an endpoint that is declared as before takes the place of its predecessor, with its queue, counts
and history for late joiners. Endpoints that the restarted node does not declare again leave when it opens.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

from busflow.bus.events import Event, MessageLost
from busflow.bus.failure import Failure
from busflow.bus.publisher import Publisher
from busflow.bus.services.client import Client
from busflow.bus.services.server import Server
from busflow.bus.subscription import Subscription
from busflow.bus.timer import Timer
from busflow.interfaces.message import Message
from busflow.node.lifetime import NodeLifetime
from busflow.validation.tracebacks import lines_of

if TYPE_CHECKING:
    from busflow.bus.bus import Bus
    from busflow.node.callbacks import EventHandler

EndpointOrTimer: TypeAlias = Publisher[Any] | Subscription[Any] | Server[Any, Any] | Client[Any, Any] | Timer
E = TypeVar("E", Publisher[Any], Subscription[Any])


class NodeEndpoints:
    """The endpoints and timers of one instance of a node; a restart makes new ones."""

    def __init__(self, life: NodeLifetime) -> None:
        self.publishers: list[Publisher[Any]] = []
        self.subscriptions: list[Subscription[Any]] = []
        self.servers: list[Server[Any, Any]] = []
        self.clients: list[Client[Any, Any]] = []
        self.timers: list[Timer] = []
        self.listeners: list[EventHandler] = []
        self.on_first: Callable[[], None] | None = None
        """Called at the node's first message, if another node waits for that."""
        self.bus: Bus | None = None
        self._life = life
        self._predecessor: NodeEndpoints | None = None

    def add(self, end: EndpointOrTimer) -> None:
        """Add an endpoint or timer, and connect and open it at once if the others are."""
        if self.bus is not None:
            self._connect(end, self.bus)
        match end:
            case Publisher():
                self.publishers.append(end)
            case Subscription():
                self.subscriptions.append(end)
            case Server():
                self.servers.append(end)
            case Client():
                self.clients.append(end)
            case _:
                self.timers.append(end)
        if self._life.is_open:
            self._open(end)
            self._listen(end)

    # Connecting.

    def connect(self, bus: Bus, predecessor: NodeEndpoints | None = None) -> None:
        """Connect all to the bus, in place of a predecessor's after a restart."""
        self.bus, self._predecessor = bus, predecessor
        for end in (*self.publishers, *self.subscriptions, *self.servers, *self.clients, *self.timers):
            self._connect(end, bus)

    def _connect(self, end: EndpointOrTimer, bus: Bus) -> None:
        match end:
            case Publisher():
                self._connect_publisher(end, bus)
            case Subscription():
                self._connect_subscription(end, bus)
            case Server():
                self._connect_server(end, bus)
            case Client():
                bus.attach_client(end)
            case _:
                self._connect_timer(end, bus)

    def _connect_publisher(self, publisher: Publisher[Any], bus: Bus) -> None:
        publisher.on_first = self.on_first
        predecessor = _same(self._predecessor.publishers, publisher) if self._predecessor else None
        bus.attach_publisher(publisher, predecessor)
        publisher.on_close = self.publishers.remove

    def _connect_subscription(self, subscription: Subscription[Any], bus: Bus) -> None:
        life = self._life
        origin = f"{subscription.endpoint.origin} (subscription {subscription.topic})"

        def on_failure(error: BaseException, message: Message) -> None:
            life.fail(origin, error, message)

        predecessor = _same(self._predecessor.subscriptions, subscription) if self._predecessor else None
        bus.attach_subscription(subscription, on_failure, predecessor)
        subscription.on_close = self.subscriptions.remove
        if any(listener.wants(subscription.topic, MessageLost) for listener in self.listeners):
            subscription.report_losses()

    def _connect_server(self, server: Server[Any, Any], bus: Bus) -> None:
        life = self._life
        origin = f"{server.endpoint.origin} (service {server.service})"

        def on_error(error: BaseException, request: Message) -> None:
            if isinstance(error, Exception | asyncio.CancelledError):  # the caller gets the error, and the node goes on
                failure = Failure(life.name, origin, error, request)
                life.log.error(failure.summary, **({"traceback": lines} if (lines := lines_of(error)) else {}))
            else:
                life.fail(origin, error, request)

        bus.attach_server(server, life.starting, on_error)

    def _connect_timer(self, timer: Timer, bus: Bus) -> None:
        life = self._life
        origin = f"{life.kind}.{timer.name} (timer)"
        for earlier in self._predecessor.timers if self._predecessor else ():
            if earlier.name == timer.name:
                timer.continue_account(earlier)
        bus.attach_timer(timer, life.spawn, lambda error: life.fail(origin, error))

    # Opening and closing.

    def open(self) -> None:
        """Start to deliver, answer and tick; the predecessor's endpoints that are not declared again leave."""
        self._life.is_open = True
        for end in (*self.subscriptions, *self.servers, *self.timers):
            self._open(end)
        for end in (*self.publishers, *self.subscriptions):
            self._listen(end)
        predecessor, self._predecessor = self._predecessor, None
        if predecessor is not None:
            predecessor.leave()

    def _open(self, end: EndpointOrTimer) -> None:
        if isinstance(end, Subscription | Server):
            pump = end.open()
            if pump is not None:
                self._life.spawn(pump, end.endpoint.origin)
        elif isinstance(end, Timer):
            end.open()

    def _listen(self, end: EndpointOrTimer) -> None:
        """Report events to the node from now on, and the current state at once."""
        if self.listeners and isinstance(end, Publisher | Subscription):
            end.on_event = self._notify
            end.report_changes()

    def _notify(self, event: Event) -> None:
        for listener in self.listeners:
            listener.notify(event)

    def close(self) -> None:
        """Stop delivering, answering and ticking; new messages stay queued and counted, waiting calls fail at once."""
        self._life.is_open = False
        for timer in self.timers:
            timer.close()
        for subscription in self.subscriptions:
            subscription.pause()
        for server in self.servers:
            server.close()

    @property
    def keep_busy(self) -> bool:
        """True if the node still reacts, answers, or keeps messages for late joiners."""
        latched = any(each.endpoint.qos.latched for each in self.publishers)
        return latched or bool(self.timers or self.servers) or any(not each.is_pulled for each in self.subscriptions)

    def leave(self) -> None:
        """Leave every topic and service; iterations over subscriptions end."""
        self.hand_over()
        for subscription in tuple(self.subscriptions):
            subscription.close()
        for publisher in tuple(self.publishers):
            publisher.close()

    def hand_over(self) -> NodeEndpoints:
        """Close the clients; return publishers and subscriptions for a successor, with those left by a predecessor."""
        predecessor, self._predecessor = self._predecessor, None
        for client in self.clients:
            client.close()
        self.clients.clear()
        # If connecting failed half-way, some endpoints were never on the bus.
        self.publishers[:] = [each for each in self.publishers if each.on_close is not None]
        self.subscriptions[:] = [each for each in self.subscriptions if each.on_close is not None]
        if predecessor is not None:
            for publisher in predecessor.publishers:
                publisher.on_close = self.publishers.remove
            for subscription in predecessor.subscriptions:
                subscription.on_close = self.subscriptions.remove
            self.publishers += predecessor.publishers
            self.subscriptions += predecessor.subscriptions
        return self


def _same(ends: list[E], successor: E) -> E | None:
    """Return the predecessor's endpoint that was declared in the same way."""
    return next((end for end in ends if end.endpoint == successor.endpoint), None)
