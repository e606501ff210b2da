"""`action_msgs`: 3 messages, 1 service, from its definition files."""

# busflow interface generate action_msgs --to busflow/msgs
# wrote this from action_msgs 2.2.0 (Apache License 2.0). The comments of its files are left out. The files:
#   msg/GoalInfo.msg         RIHS01_6398fe763154554353930716b225947f93b672f0fb2e49fdd01bb7a7e37933e9
#   msg/GoalStatus.msg       RIHS01_32f4cfd717735d17657e1178f24431c1ce996c878c515230f6c5b3476819dbb9
#   msg/GoalStatusArray.msg  RIHS01_6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e
#   srv/CancelGoal.srv       RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a

from collections.abc import Sequence
from typing import ClassVar

from busflow.interfaces.message import Message, ServiceType, int8
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.unique_identifier_msgs import UUID

__all__ = ["CancelGoal", "GoalInfo", "GoalStatus", "GoalStatusArray"]


class GoalInfo(Message, package="action_msgs"):
    """The message `action_msgs/msg/GoalInfo`."""

    goal_id: UUID = UUID()
    stamp: Time = Time()


class GoalStatus(Message, package="action_msgs"):
    """The message `action_msgs/msg/GoalStatus`."""

    STATUS_UNKNOWN: ClassVar[int8] = 0
    STATUS_ACCEPTED: ClassVar[int8] = 1
    STATUS_EXECUTING: ClassVar[int8] = 2
    STATUS_CANCELING: ClassVar[int8] = 3
    STATUS_SUCCEEDED: ClassVar[int8] = 4
    STATUS_CANCELED: ClassVar[int8] = 5
    STATUS_ABORTED: ClassVar[int8] = 6

    goal_info: GoalInfo = GoalInfo()
    status: int8 = 0


class GoalStatusArray(Message, package="action_msgs"):
    """The message `action_msgs/msg/GoalStatusArray`."""

    status_list: Sequence[GoalStatus] = ()


class CancelGoal(ServiceType, package="action_msgs"):
    """The service `action_msgs/srv/CancelGoal`."""

    class Request(Message):
        """The request."""

        goal_info: GoalInfo = GoalInfo()

    class Response(Message):
        """The response."""

        ERROR_NONE: ClassVar[int8] = 0
        ERROR_REJECTED: ClassVar[int8] = 1
        ERROR_UNKNOWN_GOAL_ID: ClassVar[int8] = 2
        ERROR_GOAL_TERMINATED: ClassVar[int8] = 3

        return_code: int8 = 0
        goals_canceling: Sequence[GoalInfo] = ()
