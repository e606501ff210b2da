# `imported_at_use` reads the homes of the names here, so each has a line of its own.
from collections.abc import Callable
from typing import Any

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

__version__: str

def imported_at_use(namespace: dict[str, Any]) -> Callable[[str], Any]: ...
