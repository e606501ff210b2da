"""busflow: a robot's node graph that you `pip install`.

All public names of the core are here. They are imported at first use, so that the command line starts fast.
"""

TYPE_CHECKING = False  # as `typing` has it, which takes longer to import than all else before the command line
if TYPE_CHECKING:
    from busflow.actions.client import ActionClient as ActionClient
    from busflow.actions.client import SentGoal as SentGoal
    from busflow.actions.declarations import action as action
    from busflow.actions.declarations import action_client as action_client
    from busflow.actions.goal import GoalState as GoalState
    from busflow.actions.goal import RunningGoal as RunningGoal
    from busflow.actions.server import ActionServer as ActionServer
    from busflow.bus.events import DeadlineMissed as DeadlineMissed
    from busflow.bus.events import LivelinessChanged as LivelinessChanged
    from busflow.bus.events import LivelinessLost as LivelinessLost
    from busflow.bus.events import MessageLost as MessageLost
    from busflow.bus.events import PublisherMatched as PublisherMatched
    from busflow.bus.events import SubscriptionMatched as SubscriptionMatched
    from busflow.bus.publisher import Publisher as Publisher
    from busflow.bus.qos import DEFAULT as DEFAULT
    from busflow.bus.qos import SENSOR_DATA as SENSOR_DATA
    from busflow.bus.qos import TRANSIENT_LOCAL as TRANSIENT_LOCAL
    from busflow.bus.qos import Durability as Durability
    from busflow.bus.qos import Overflow as Overflow
    from busflow.bus.qos import QoS as QoS
    from busflow.bus.qos import Reliability as Reliability
    from busflow.bus.services.client import Client as Client
    from busflow.bus.services.server import Server as Server
    from busflow.bus.subscription import Subscription as Subscription
    from busflow.bus.timer import Timer as Timer
    from busflow.clock import Clock as Clock
    from busflow.clock import Duration as Duration
    from busflow.clock import Time as Time
    from busflow.errors import ActionError as ActionError
    from busflow.errors import ActionGone as ActionGone
    from busflow.errors import ActionUnavailable as ActionUnavailable
    from busflow.errors import BusflowError as BusflowError
    from busflow.errors import DeadlockError as DeadlockError
    from busflow.errors import FramesNotConnected as FramesNotConnected
    from busflow.errors import GoalAborted as GoalAborted
    from busflow.errors import GoalCanceled as GoalCanceled
    from busflow.errors import GoalRejected as GoalRejected
    from busflow.errors import GoalTimeout as GoalTimeout
    from busflow.errors import InvalidTransform as InvalidTransform
    from busflow.errors import LaunchError as LaunchError
    from busflow.errors import NodeFailed as NodeFailed
    from busflow.errors import SendTimeout as SendTimeout
    from busflow.errors import ServiceError as ServiceError
    from busflow.errors import ServiceFailed as ServiceFailed
    from busflow.errors import ServiceGone as ServiceGone
    from busflow.errors import ServiceTimeout as ServiceTimeout
    from busflow.errors import ServiceUnavailable as ServiceUnavailable
    from busflow.errors import TransformError as TransformError
    from busflow.errors import TransformNotThere as TransformNotThere
    from busflow.errors import TransformTooOld as TransformTooOld
    from busflow.errors import UnknownFrame as UnknownFrame
    from busflow.errors import WouldBlock as WouldBlock
    from busflow.frames.declarations import Frames as Frames
    from busflow.frames.declarations import transforms as transforms
    from busflow.interfaces.action import ActionType as ActionType
    from busflow.interfaces.message import Length as Length
    from busflow.interfaces.message import Message as Message
    from busflow.interfaces.message import ServiceType as ServiceType
    from busflow.interfaces.message import take as take
    from busflow.launchfile.model.supervision import RestartPolicy as RestartPolicy
    from busflow.log import Logger as Logger
    from busflow.node.declarations import client as client
    from busflow.node.declarations import publisher as publisher
    from busflow.node.declarations import timer as timer
    from busflow.node.handlers import on_event as on_event
    from busflow.node.handlers import on_parameters as on_parameters
    from busflow.node.handlers import service as service
    from busflow.node.handlers import subscription as subscription
    from busflow.node.node import Node as Node
    from busflow.node.parameters import Parameters as Parameters
    from busflow.node.parameters import ReadOnly as ReadOnly
    from busflow.node.supervision import supervised as supervised
    from busflow.pairing.declarations import synchronized as synchronized
    from busflow.pairing.members import Unpaired as Unpaired
    from busflow.program import launch as launch
    from busflow.program import run as run
    from busflow.runner.graph import Graph as Graph

_HOMES = {
    "ActionClient": "actions.client",
    "ActionError": "errors",
    "ActionGone": "errors",
    "ActionServer": "actions.server",
    "ActionType": "interfaces.action",
    "ActionUnavailable": "errors",
    "BusflowError": "errors",
    "Client": "bus.services.client",
    "Clock": "clock",
    "DEFAULT": "bus.qos",
    "DeadlineMissed": "bus.events",
    "DeadlockError": "errors",
    "Durability": "bus.qos",
    "Duration": "clock",
    "Frames": "frames.declarations",
    "FramesNotConnected": "errors",
    "GoalAborted": "errors",
    "GoalCanceled": "errors",
    "GoalRejected": "errors",
    "GoalState": "actions.goal",
    "GoalTimeout": "errors",
    "Graph": "runner.graph",
    "InvalidTransform": "errors",
    "LaunchError": "errors",
    "Length": "interfaces.message",
    "LivelinessChanged": "bus.events",
    "LivelinessLost": "bus.events",
    "Logger": "log",
    "Message": "interfaces.message",
    "MessageLost": "bus.events",
    "Node": "node.node",
    "NodeFailed": "errors",
    "Overflow": "bus.qos",
    "Parameters": "node.parameters",
    "Publisher": "bus.publisher",
    "PublisherMatched": "bus.events",
    "QoS": "bus.qos",
    "ReadOnly": "node.parameters",
    "Reliability": "bus.qos",
    "RestartPolicy": "launchfile.model.supervision",
    "RunningGoal": "actions.goal",
    "SENSOR_DATA": "bus.qos",
    "SendTimeout": "errors",
    "SentGoal": "actions.client",
    "Server": "bus.services.server",
    "ServiceError": "errors",
    "ServiceFailed": "errors",
    "ServiceGone": "errors",
    "ServiceTimeout": "errors",
    "ServiceType": "interfaces.message",
    "ServiceUnavailable": "errors",
    "Subscription": "bus.subscription",
    "SubscriptionMatched": "bus.events",
    "TRANSIENT_LOCAL": "bus.qos",
    "Time": "clock",
    "Timer": "bus.timer",
    "TransformError": "errors",
    "TransformNotThere": "errors",
    "TransformTooOld": "errors",
    "UnknownFrame": "errors",
    "Unpaired": "pairing.members",
    "WouldBlock": "errors",
    "action": "actions.declarations",
    "action_client": "actions.declarations",
    "client": "node.declarations",
    "launch": "program",
    "on_event": "node.handlers",
    "on_parameters": "node.handlers",
    "publisher": "node.declarations",
    "run": "program",
    "service": "node.handlers",
    "subscription": "node.handlers",
    "supervised": "node.supervision",
    "synchronized": "pairing.declarations",
    "take": "interfaces.message",
    "timer": "node.declarations",
    "transforms": "frames.declarations",
}

__all__ = [
    "DEFAULT",
    "SENSOR_DATA",
    "TRANSIENT_LOCAL",
    "ActionClient",
    "ActionError",
    "ActionGone",
    "ActionServer",
    "ActionType",
    "ActionUnavailable",
    "BusflowError",
    "Client",
    "Clock",
    "DeadlineMissed",
    "DeadlockError",
    "Durability",
    "Duration",
    "Frames",
    "FramesNotConnected",
    "GoalAborted",
    "GoalCanceled",
    "GoalRejected",
    "GoalState",
    "GoalTimeout",
    "Graph",
    "InvalidTransform",
    "LaunchError",
    "Length",
    "LivelinessChanged",
    "LivelinessLost",
    "Logger",
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
    "RunningGoal",
    "SendTimeout",
    "SentGoal",
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
    "TransformError",
    "TransformNotThere",
    "TransformTooOld",
    "UnknownFrame",
    "Unpaired",
    "WouldBlock",
    "action",
    "action_client",
    "client",
    "launch",
    "on_event",
    "on_parameters",
    "publisher",
    "run",
    "service",
    "subscription",
    "supervised",
    "synchronized",
    "take",
    "timer",
    "transforms",
]

__version__ = "0.1.0"


def __getattr__(name: str) -> object:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'busflow' has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"busflow.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
