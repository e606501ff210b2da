"""Rosout: publishes the run's log on `/rosout`, as ROS 2 does, while the topic has a subscription.

It has a publisher from the first subscription on, or once the run can be looked into from outside. A line becomes a
message only while the topic has a subscription, or where nodes of ROS 2 may come and ask for earlier lines.
"""

from __future__ import annotations

from threading import get_ident
from typing import TYPE_CHECKING, Any

from busflow.bus.bus import Bus, BusObserver
from busflow.bus.endpoint import LOG_NODE, ROSOUT, Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import Durability, QoS
from busflow.clock import NS_PER_S
from busflow.errors import BusflowError
from busflow.log import LEVELS, Log, LogRecord, values_text
from busflow.text import printable

if TYPE_CHECKING:
    from busflow.bus.subscription import Subscription
    from busflow.msgs.rcl_interfaces import Log as LogMessage

_DEPTH = 1000
_ROS2_QOS = QoS(depth=_DEPTH, durability=Durability.TRANSIENT_LOCAL, lifespan_s=10)
"""ROS 2's own: its viewers of the log request `transient_local`. Source: ros2/rcl 9.2, `logging_rosout.h`."""


class Rosout(BusObserver):
    """Publisher of `/rosout`.

    Two things keep a line from causing the next one without end: what is logged while a line is being published is not
    published, and neither is what a node logs that receives the topic itself. The log has all of them.
    """

    def __init__(self, bus: Bus, log: Log, *, to_ros2: bool = False) -> None:
        self.refused: int = 0
        """Lines that a subscription with `overflow: block` had no room for, or that came after the end."""
        self._bus, self._log, self._to_ros2 = bus, log, to_ros2
        self._publisher: Publisher[LogMessage] | None = None
        self._publishing: set[int] = set()
        bus.observe(self)

    def announce(self, durability: Durability = Durability.VOLATILE) -> None:
        """Create a publisher of the topic, which offers this durability, or what nodes of ROS 2 expect."""
        if self._publisher is not None:
            return
        from busflow.msgs.rcl_interfaces import Log as LogMessage

        qos = _ROS2_QOS if self._to_ros2 else QoS(depth=_DEPTH, durability=durability)
        publisher = Publisher(LogMessage, Endpoint(LOG_NODE, ROSOUT, LogMessage, qos, "the run's log", ROSOUT))
        self._publisher = publisher
        try:
            self._bus.attach_publisher(publisher)
        except BusflowError as error:
            self._log.bind("busflow").warning(f"the log is not published on {ROSOUT}: {error}")
            return
        self._log.sinks.append(self._write)

    def subscription_added(self, subscription: Subscription[Any]) -> None:
        """Create the publisher for the first subscription."""
        if subscription.topic == ROSOUT:
            self.announce(subscription.endpoint.qos.durability)

    def _write(self, record: LogRecord) -> None:
        publisher, thread = self._publisher, get_ident()
        if publisher is None or thread in self._publishing or not (self._to_ros2 or publisher.is_received):
            return
        # Another process publishes its lines itself, and a node that receives the topic would hear itself without end.
        if record.process or any(each.endpoint.node == record.node for each in self._bus.topics[ROSOUT].subscriptions):
            return
        self._publishing.add(thread)
        try:
            publisher.publish(log_message(record))
        except BusflowError:  # a log call must not fail for it, and logging it would come here again
            self.refused += 1
        finally:
            self._publishing.discard(thread)


def log_message(record: LogRecord) -> LogMessage:
    """Return a line of the log as ROS 2 sends it.

    >>> message = log_message(LogRecord(1_500_000_000, "warning", "/arm", "slow", {"load": 0.9, "at": "arm.py:7:5"}))
    >>> message.level, message.msg, message.file, message.line, message.stamp.nanosec
    (30, 'slow load=0.9 at=arm.py:7:5', 'arm.py', 7, 500000000)
    """
    from busflow.msgs.builtin_interfaces import Time
    from busflow.msgs.rcl_interfaces import Log as LogMessage

    seconds, nanoseconds = divmod(record.stamp_ns, NS_PER_S)
    file, line = _place(record)
    return LogMessage(
        stamp=Time(sec=seconds, nanosec=nanoseconds),
        level=LEVELS.get(record.level, LEVELS["info"]),
        name=printable(record.node),
        msg=line_text(record),
        file=file,
        line=line,
    )


def line_text(record: LogRecord) -> str:
    """Return a line's text and values, safe for a terminal."""
    return "\n".join(printable(each) for each in record.event.split("\n")) + values_text(record.values)


def _place(record: LogRecord) -> tuple[str, int]:
    """Return the file and line that the record names: an exception's `at`."""
    file, _, line = str(record.values.get("at", "")).rpartition(":")[0].rpartition(":")
    return (printable(file), int(line)) if line.isdecimal() and len(line) < 8 else ("", 0)
