"""Endpoint: the description of one end of a topic or a service, known without running it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

from busflow.bus.qos import QoS
from busflow.interfaces.message import Message, ServiceType

ROSOUT = "/rosout"
"""The topic of the run's log."""
LOG_NODE = "/_log"
"""The node that publishes the log, for all nodes of the run."""
UNANNOUNCED = frozenset({ROSOUT, "/tf", "/tf_static"})
"""Topics whose publishers may come with their first message; a subscription without one is no mistake there."""
PARAMETER_EVENTS = "/parameter_events"
"""The topic of the parameter changes of all nodes."""


Line: TypeAlias = tuple[str, int]
"""A file of code and the number of one of its lines."""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """The description of one end of a topic, known without running it."""

    node: str
    """The fully qualified name of its node, `/left/arm`."""
    topic: str
    """The final name of its topic, `/imu/data`."""
    type: type[Message]
    qos: QoS
    origin: str
    """The declaring class and attribute, for messages: `SensorProcessor.on_imu`."""
    written: str
    """The topic's name as the node wrote it, before namespaces and remapping."""
    remap_rule: str | None = None
    """The remap rule that applied, if one did."""
    remote: bool = False
    """True in another process; its mistakes are then not blamed on a node of this one."""
    line: Line | None = field(default=None, compare=False)
    """The file and the line that create it, where known."""
    stated: frozenset[str] = field(default=frozenset(), compare=False)
    """The fields of its QoS that this line states."""


@dataclass(frozen=True, slots=True)
class ServiceEndpoint:
    """The description of one end of a service, known without running it."""

    node: str
    """The fully qualified name of its node, `/left/arm`."""
    service: str
    """The final name of its service, `/left/arm/reset`."""
    type: type[ServiceType]
    origin: str
    """The declaring class and attribute, for messages: `Arm.on_reset`."""
    written: str
    """The service's name as the node wrote it, before namespaces and remapping."""
    remap_rule: str | None = None
    """The remap rule that applied, if one did."""
    line: Line | None = field(default=None, compare=False)
    """The file and the line that create it, where known."""
