"""busflow: a robot's node graph that you `pip install`.

Everything public of the core is here, imported when first used so that the command line starts fast.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from busflow.clients import Client as Client
    from busflow.clock import Clock as Clock
    from busflow.clock import Duration as Duration
    from busflow.clock import Time as Time
    from busflow.declarations import client as client
    from busflow.declarations import publisher as publisher
    from busflow.declarations import timer as timer
    from busflow.errors import BusflowError as BusflowError
    from busflow.errors import DeadlockError as DeadlockError
    from busflow.errors import LaunchError as LaunchError
    from busflow.errors import NodeFailed as NodeFailed
    from busflow.errors import SendTimeout as SendTimeout
    from busflow.errors import ServiceError as ServiceError
    from busflow.errors import ServiceFailed as ServiceFailed
    from busflow.errors import ServiceGone as ServiceGone
    from busflow.errors import ServiceTimeout as ServiceTimeout
    from busflow.errors import ServiceUnavailable as ServiceUnavailable
    from busflow.errors import WouldBlock as WouldBlock
    from busflow.events import DeadlineMissed as DeadlineMissed
    from busflow.events import LivelinessChanged as LivelinessChanged
    from busflow.events import LivelinessLost as LivelinessLost
    from busflow.events import MessageLost as MessageLost
    from busflow.events import PublisherMatched as PublisherMatched
    from busflow.events import SubscriptionMatched as SubscriptionMatched
    from busflow.handlers import on_event as on_event
    from busflow.handlers import on_parameters as on_parameters
    from busflow.handlers import service as service
    from busflow.handlers import subscription as subscription
    from busflow.message import Length as Length
    from busflow.message import Message as Message
    from busflow.message import ServiceType as ServiceType
    from busflow.message import take as take
    from busflow.node import Node as Node
    from busflow.parameters import Parameters as Parameters
    from busflow.parameters import ReadOnly as ReadOnly
    from busflow.program import launch as launch
    from busflow.publishers import Publisher as Publisher
    from busflow.qos import DEFAULT as DEFAULT
    from busflow.qos import SENSOR_DATA as SENSOR_DATA
    from busflow.qos import Durability as Durability
    from busflow.qos import Overflow as Overflow
    from busflow.qos import QoS as QoS
    from busflow.qos import Reliability as Reliability
    from busflow.runner import Graph as Graph
    from busflow.script import run as run
    from busflow.servers import Server as Server
    from busflow.subscriptions import Subscription as Subscription
    from busflow.supervision import RestartPolicy as RestartPolicy
    from busflow.supervision import supervised as supervised
    from busflow.timers import Timer as Timer

_HOMES = {
    "BusflowError": "errors",
    "Client": "clients",
    "Clock": "clock",
    "DEFAULT": "qos",
    "DeadlineMissed": "events",
    "DeadlockError": "errors",
    "Durability": "qos",
    "Duration": "clock",
    "Graph": "runner",
    "LaunchError": "errors",
    "Length": "message",
    "LivelinessChanged": "events",
    "LivelinessLost": "events",
    "Message": "message",
    "MessageLost": "events",
    "Node": "node",
    "NodeFailed": "errors",
    "Overflow": "qos",
    "Parameters": "parameters",
    "Publisher": "publishers",
    "PublisherMatched": "events",
    "QoS": "qos",
    "ReadOnly": "parameters",
    "Reliability": "qos",
    "SENSOR_DATA": "qos",
    "RestartPolicy": "supervision",
    "SendTimeout": "errors",
    "Server": "servers",
    "ServiceError": "errors",
    "ServiceFailed": "errors",
    "ServiceGone": "errors",
    "ServiceTimeout": "errors",
    "ServiceType": "message",
    "ServiceUnavailable": "errors",
    "Subscription": "subscriptions",
    "SubscriptionMatched": "events",
    "Time": "clock",
    "Timer": "timers",
    "WouldBlock": "errors",
    "client": "declarations",
    "launch": "program",
    "on_event": "handlers",
    "on_parameters": "handlers",
    "publisher": "declarations",
    "run": "script",
    "service": "handlers",
    "subscription": "handlers",
    "supervised": "supervision",
    "take": "message",
    "timer": "declarations",
}

__all__ = [
    "DEFAULT",
    "SENSOR_DATA",
    "BusflowError",
    "Client",
    "Clock",
    "DeadlineMissed",
    "DeadlockError",
    "Durability",
    "Duration",
    "Graph",
    "LaunchError",
    "Length",
    "LivelinessChanged",
    "LivelinessLost",
    "Message",
    "MessageLost",
    "Node",
    "NodeFailed",
    "Overflow",
    "Parameters",
    "Publisher",
    "PublisherMatched",
    "QoS",
    "ReadOnly",
    "Reliability",
    "RestartPolicy",
    "SendTimeout",
    "Server",
    "ServiceError",
    "ServiceFailed",
    "ServiceGone",
    "ServiceTimeout",
    "ServiceType",
    "ServiceUnavailable",
    "Subscription",
    "SubscriptionMatched",
    "Time",
    "Timer",
    "WouldBlock",
    "client",
    "launch",
    "on_event",
    "on_parameters",
    "publisher",
    "run",
    "service",
    "subscription",
    "supervised",
    "take",
    "timer",
]

__version__ = "0.1.0"


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'busflow' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"busflow.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
