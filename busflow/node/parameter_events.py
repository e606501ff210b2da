"""ParameterEvents: publishes a node's parameters on `/parameter_events`, as ROS 2 does, if it has subscriptions."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Any

from structlog.typing import FilteringBoundLogger

from busflow.bus import qos
from busflow.bus.endpoint import PARAMETER_EVENTS
from busflow.bus.publisher import Publisher
from busflow.clock import Clock
from busflow.errors import BusflowError
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
        log: FilteringBoundLogger,
    ) -> None:
        self._parameters = parameters
        self._create = create_publisher
        self._clock = clock
        self._log = log
        self._publisher: Publisher[ParameterEvent] | None = None

    def declare(self) -> None:
        """Publish from now on: a node of the graph listens, and both ends are checked before anything runs."""
        if self._publisher is None and self._parameters.infos:
            self._publisher = self._created()

    def take_over(self, former: ParameterEvents) -> None:
        """Publish from the start if the node's former instance published."""
        if former._publisher is not None:
            self.declare()

    def publish_all(self) -> None:
        """Publish every parameter as a new one, for subscriptions that are there from the start."""
        if self._publisher is not None:
            rows = self._parameters.describe()
            self._publish(self._publisher, [ParameterChange(row.name, None, row.value) for row in rows])

    def publish(self, changes: Iterable[ParameterChange], bus: Bus) -> None:
        """Publish a change. A subscription whose QoS does not fit receives nothing, and the log says so."""
        topic = bus.topics.get(PARAMETER_EVENTS)
        if self._publisher is None and (topic is None or not topic.pushes):
            return
        try:
            self._publisher = self._publisher or self._created()
            self._publish(self._publisher, changes)
        except BusflowError as error:
            self._log.warning("a change of parameters is not announced", topic=PARAMETER_EVENTS, reason=str(error))

    def _created(self) -> Publisher[ParameterEvent]:
        from busflow.msgs.rcl_interfaces import ParameterEvent

        return self._create(ParameterEvent, PARAMETER_EVENTS, qos.PARAMETER_EVENTS, origin="parameter events")

    def _publish(self, publisher: Publisher[ParameterEvent], changes: Iterable[ParameterChange]) -> None:
        from busflow.node.parameter_messages import event_message

        store = self._parameters
        publisher.publish(event_message(self._clock.now(), store.node, changes, store.infos))
