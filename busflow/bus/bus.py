"""Bus: the topics and services of one process, their endpoints, and the ledger that accounts for every message.

A bus is an object: two in one process are independent. It checks every new endpoint against those already
attached. It owns the dispatcher, and the inbox through which other threads publish.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Hashable, Iterator
from functools import partial
from threading import get_ident
from typing import Any, TypeAlias, TypeVar, cast

from busflow.bus.dispatcher import Chooser, Dispatcher
from busflow.bus.endpoint import Endpoint
from busflow.bus.inbox import Inbox
from busflow.bus.publisher import Publisher
from busflow.bus.qos_matching import Verdict, compatibility
from busflow.bus.services.call import Activity
from busflow.bus.services.client import Client
from busflow.bus.services.server import OnError, Server
from busflow.bus.services.service import Service
from busflow.bus.statistics import BusStatistics, SubscriptionStatistics
from busflow.bus.subscription import OnFailure, Subscription
from busflow.bus.timer import Spawn, Timer
from busflow.bus.topic import Topic
from busflow.clock import Clock, SystemClock
from busflow.errors import IncompatibleQoS, IncompatibleType
from busflow.interfaces.message import Message, ServiceType, type_name

M = TypeVar("M", bound=Message)
R = TypeVar("R")

AnyEndpoint: TypeAlias = Publisher[Any] | Subscription[Any] | Server[Any, Any] | Client[Any, Any]
"""One end of a topic or of a service."""


class BusObserver:
    """Base class of the observers that `Bus.observe` takes. A subclass overrides the methods that it needs.

    An exception of a method is raised to the code that attaches the endpoint.
    """

    __slots__ = ()

    def topic_added(self, topic: Topic[Any]) -> None:
        """Handle a new topic, before its first endpoint."""

    def publisher_added(self, publisher: Publisher[Any]) -> None:
        """Handle a publisher, before its first message; a restarted node's comes again."""

    def subscription_added(self, subscription: Subscription[Any]) -> None:
        """Handle a subscription, before a message is handed over to it; a restarted node's comes again."""

    def service_added(self, service: Service[Any, Any]) -> None:
        """Handle a new service, before its server and its first client."""

    def server_added(self, server: Server[Any, Any]) -> None:
        """Handle a server of this process."""

    def client_added(self, client: Client[Any, Any]) -> None:
        """Handle a client of this process."""

    def timer_added(self, timer: Timer) -> None:
        """Handle a timer, before its first tick."""

    def parameters_added(self, store: Any) -> None:  # a ParameterStore: package `node`, above this one, defines it
        """Handle the parameters of a node, before its endpoints come."""

    def endpoint_removed(self, end: AnyEndpoint) -> None:
        """Handle an endpoint that has left; a restarted node's leaves as its successor comes."""


class Bus:
    """The topics and services of one process by name, with their dispatcher and inbox."""

    def __init__(self, clock: Clock | None = None, *, explore: Chooser | None = None) -> None:
        """Create a bus that does not deliver until `open`.

        Args:
            clock: the run's clock, by default the system's. In simulated time turns are budgeted by messages, not by
                wall time, so that every run is the same.
            explore: chooses among the permitted orders of delivery.
        """
        self.topics: dict[str, Topic[Any]] = {}
        self.services: dict[str, Service[Any, Any]] = {}
        self.shared: dict[Hashable, Any] = {}
        """Objects of packages above that the nodes of the process share, each under a key of its own."""
        self.observers: list[BusObserver] = []
        self.clock: Clock = clock or SystemClock()
        self.dispatcher: Dispatcher = Dispatcher(virtual=self.clock.kind == "sim", explore=explore)
        self.inbox: Inbox = Inbox(self.dispatcher)
        self._thread = get_ident()

    def open(self) -> None:
        """Start to deliver, on the running event loop."""
        self._thread = get_ident()
        loop = asyncio.get_running_loop()
        self.dispatcher.open(loop)
        self.inbox.open(loop)

    def close(self) -> None:
        """Stop delivering; queued messages stay counted as queued."""
        self.inbox.close()
        self.dispatcher.close()

    def observe(self, observer: BusObserver) -> None:
        """Call an observer from now on; the topics and services that are there are added to it at once."""
        self.observers.append(observer)
        for topic in self.topics.values():
            observer.topic_added(topic)
        for service in self.services.values():
            observer.service_added(service)

    def attach_publisher(self, publisher: Publisher[M], predecessor: Publisher[M] | None = None) -> None:
        """Connect a publisher to its topic; after a restart it takes the place of its predecessor.

        Raises:
            IncompatibleType: the topic is of another type.
            IncompatibleQoS: a subscription there requests more than the publisher offers.
        """
        if predecessor is None:
            topic = self._topic(publisher.endpoint, publisher.type)
            for subscription in topic.subscriptions:
                check_qos(publisher.endpoint, subscription.endpoint)
            publisher.attach(topic, self._thread, partial(self.inbox.put, topic.losses))
        else:
            publisher.adopt(predecessor)
        for observer in self.observers:
            observer.publisher_added(publisher)

    def attach_subscription(
        self, subscription: Subscription[M], on_failure: OnFailure, predecessor: Subscription[M] | None = None
    ) -> None:
        """Connect a subscription to its topic; it receives what transient_local publishers kept.

        After a restart it takes over the place, the queue and the counts of its predecessor.

        Raises:
            IncompatibleType: the topic is of another type.
            IncompatibleQoS: it requests more than a publisher there offers.
        """
        if predecessor is None:
            topic = self._topic(subscription.endpoint, subscription.type)
            for publisher in topic.publishers:
                if not publisher.endpoint.remote:  # the code that attaches a remote one checks it
                    check_qos(publisher.endpoint, subscription.endpoint)
            subscription.attach(topic, self.dispatcher, on_failure)
        else:
            subscription.adopt(predecessor, on_failure)
        for observer in self.observers:
            observer.subscription_added(subscription)

    def attach_timer(self, timer: Timer, spawn: Spawn, on_failure: Callable[[BaseException], None]) -> None:
        """Connect a timer to the run's clock and the dispatcher."""
        timer.attach(self.clock, self.dispatcher, spawn, on_failure)
        for observer in self.observers:
            observer.timer_added(timer)

    def call(self, function: Callable[[], R]) -> R:
        """Call a function on the graph's own thread; other threads wait for the result.

        Raises:
            NotRunning: the graph's event loop does not run, or is too busy to answer.
        """
        return function() if get_ident() == self._thread else self.inbox.call(function)

    def attach_server(self, server: Server[Any, Any], starting: Activity, on_error: OnError) -> None:
        """Connect a server to its service.

        Raises:
            IncompatibleType: the service is of another type.
            DuplicateServer: the service has a server.
        """
        endpoint = server.endpoint
        service = self.service(endpoint.service, server.type, endpoint.origin)
        service.refuse_second(endpoint.origin)
        server.attach(service, self.dispatcher, starting, on_error)
        for observer in self.observers:
            observer.server_added(server)

    def attach_client(self, client: Client[Any, Any]) -> None:
        """Connect a client to its service, which may have no server yet.

        Raises:
            IncompatibleType: the service is of another type.
        """
        client.attach(self.service(client.service, client.type, client.endpoint.origin))
        for observer in self.observers:
            observer.client_added(client)

    def service(self, name: str, service_type: type[ServiceType], origin: str) -> Service[Any, Any]:
        """Return the service of a name, created if necessary; `origin` names the caller in errors.

        Raises:
            IncompatibleType: it is of another type.
        """
        service = self.services.get(name)
        if service is None:
            service = self.services[name] = Service(name, service_type, self.clock, self.services, self._on_leave)
            for observer in self.observers:
                observer.service_added(service)
        elif service.type is not service_type:
            raise IncompatibleType(
                f"{origin} uses the service {name} as {type_name(service_type)}, but it is a {type_name(service.type)}"
            )
        return service

    def tap(self, topic: Topic[M], tap: Callable[[M], None]) -> None:
        """Call `tap` with every message of a topic as it is published, before it reaches a queue."""
        topic.taps.append(tap)
        topic.rebuild()

    def keep_recent(self, topic: Topic[Any], depth: int) -> None:
        """Keep the last `depth` messages of a topic from now on, from all publishers; 0 keeps none."""
        topic.recent = deque(maxlen=depth) if depth else None
        topic.rebuild()

    def untap(self, topic: Topic[M], tap: Callable[[M], None]) -> None:
        """Remove a tap."""
        topic.taps.remove(tap)
        topic.rebuild()

    def ledger(self) -> Iterator[SubscriptionStatistics]:
        """Yield one line per present or past subscription; in each, `published == delivered + dropped + queued`."""
        for topic in self.topics.values():
            yield from topic.statistics().subscriptions

    def statistics(self) -> BusStatistics:
        """Return the current counts of the bus, from one walk over all endpoints."""
        return BusStatistics(
            topics=tuple(self.topics[name].statistics() for name in sorted(self.topics)),
            services=tuple(self.services[name].statistics() for name in sorted(self.services)),
            inbox=self.inbox.statistics(),
            dispatcher=self.dispatcher.statistics(),
        )

    def _topic(self, endpoint: Endpoint, message_type: type[M]) -> Topic[M]:
        topic = self.topics.get(endpoint.topic)
        if topic is None:
            topic = self.topics[endpoint.topic] = Topic(endpoint.topic, message_type, self.clock, self._on_leave)
            for observer in self.observers:
                observer.topic_added(topic)
        elif topic.type is not message_type:
            raise IncompatibleType(
                f"{endpoint.origin} uses {endpoint.topic} as {type_name(message_type)}, "
                f"but it carries {type_name(topic.type)}"
            )
        return topic

    def _on_leave(self, end: object) -> None:
        for observer in self.observers:
            observer.endpoint_removed(cast("AnyEndpoint", end))  # topics and services know their ends as protocols


def check_qos(offered: Endpoint, requested: Endpoint) -> None:
    """Refuse a publisher that offers less than a subscription requests.

    Raises:
        IncompatibleQoS: naming both ends, every reason and the smallest fix.
    """
    found = compatibility(offered.qos, requested.qos)
    if found.verdict is Verdict.ERROR:
        raise IncompatibleQoS(
            f"{requested.origin} cannot receive from {offered.origin} on {offered.topic}: "
            f"{'; '.join(found.reasons)}; {found.fix}"
        )
