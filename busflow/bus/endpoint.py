"""Endpoint: what is known of one end of a topic or a service without running it."""

from __future__ import annotations

from dataclasses import dataclass

from busflow.bus.qos import QoS
from busflow.interfaces.message import Message, ServiceType

ROSOUT = "/rosout"
"""The topic of the run's log."""
LOG_NODE = "/_log"
"""The node that publishes it, for all nodes of the run."""
PARAMETER_EVENTS = "/parameter_events"
"""The topic of every node's changes of parameters."""


@dataclass(frozen=True, slots=True)
class Endpoint:
    """What is known of one end of a topic without running it."""

    node: str
    """The fully qualified name of its node, `/left/arm`."""
    topic: str
    """The final name of its topic, `/imu/data`."""
    type: type[Message]
    qos: QoS
    origin: str
    """What declares it, for people: `SensorProcessor.on_imu`."""
    written: str
    """The topic's name as the node wrote it, before namespaces and remapping."""
    remap_rule: str | None = None
    """The remap rule that applied, if one did."""
    remote: bool = False
    """Whether it is in another process, whose mistakes are no fault of a node here."""


@dataclass(frozen=True, slots=True)
class ServiceEndpoint:
    """What is known of one end of a service without running it."""

    node: str
    """The fully qualified name of its node, `/left/arm`."""
    service: str
    """The final name of its service, `/left/arm/reset`."""
    type: type[ServiceType]
    origin: str
    """What declares it, for people: `Arm.on_reset`."""
    written: str
    """The service's name as the node wrote it, before namespaces and remapping."""
    remap_rule: str | None = None
    """The remap rule that applied, if one did."""
