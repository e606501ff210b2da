"""ParameterEvents: publishes a node's parameters on `/parameter_events`, as ROS 2 does, where they can be received."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from busflow.bus import qos
from busflow.bus.endpoint import PARAMETER_EVENTS
from busflow.bus.publisher import Publisher
from busflow.clock import Clock
from busflow.errors import BusflowError
from busflow.log import Logger
from busflow.node.parameter_store import ParameterChange, ParameterStore

if TYPE_CHECKING:
    from busflow.bus.bus import Bus
    from busflow.msgs.rcl_interfaces import ParameterEvent


class ParameterEvents:
    """One node's end of the topic. It costs nothing until a parameter is set, and little without a subscription."""

    __slots__ = ("_clock", "_create", "_log", "_parameters", "_publisher")

    def __init__(
        self,
        parameters: ParameterStore,
        create_publisher: Callable[..., Publisher[Any]],
        clock: Clock,
        log: Logger,
    ) -> None:
        self._parameters = parameters
        self._create = create_publisher
        self._clock = clock
        self._log = log
        self._publisher: Publisher[ParameterEvent] | None = None

    def declare(self) -> None:
        """Create the publisher. Before the start, where a node of the graph subscribes, both ends are checked then."""
        if self._publisher is None and self._parameters.infos:
            self._publisher = self._created()

    def take_over(self, former: ParameterEvents) -> None:
        """Publish from the start if the node's former instance published."""
        if former._publisher is not None:
            self.declare()

    def open(self) -> None:
        """Publish every parameter as a new one, for subscriptions that are there from the start.

        Where other processes see the parameters the topic is there from now on, so that they find it.
        """
        with self._logged():
            if self._parameters.is_shown:
                self.declare()
            if self._publisher is not None and self._publisher.is_received:
                rows = self._parameters.describe()
                self._publish(self._publisher, [ParameterChange(row.name, None, row.value) for row in rows])

    def publish(self, changes: Iterable[ParameterChange], bus: Bus) -> None:
        """Publish a change. A subscription whose QoS does not fit receives nothing, and the log says so."""
        topic = bus.topics.get(PARAMETER_EVENTS)
        if self._publisher is None and (topic is None or not topic.pushes):
            return
        with self._logged():
            self._publisher = self._publisher or self._created()
            self._publish(self._publisher, changes)

    @contextmanager
    def _logged(self) -> Generator[None]:
        """Log an error instead of raising it: a node does not fail because others cannot follow its parameters."""
        try:
            yield
        except BusflowError as error:
            self._log.warning("a change of parameters is not announced", topic=PARAMETER_EVENTS, reason=str(error))

    def _created(self) -> Publisher[ParameterEvent]:
        from busflow.msgs.rcl_interfaces import ParameterEvent

        return self._create(ParameterEvent, PARAMETER_EVENTS, qos.PARAMETER_EVENTS, origin="parameter events")

    def _publish(self, publisher: Publisher[ParameterEvent], changes: Iterable[ParameterChange]) -> None:
        from busflow.node.parameter_messages import event_message

        store = self._parameters
        publisher.publish(event_message(self._clock.now(), store.node, changes, store.infos))
