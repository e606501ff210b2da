"""`action_msgs`: 3 messages, 1 service, from its definition files."""

# busflow interface generate action_msgs --to busflow/msgs
# wrote this from action_msgs 2.2.0 (Apache License 2.0). Change its files instead, and run that again:
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
    """Goal ID"""
    stamp: Time = Time()
    """Time when the goal was accepted"""


class GoalStatus(Message, package="action_msgs"):
    """An action goal can be in one of these states after it is accepted by an action
    server.

    For more information, see http://design.ros2.org/articles/actions.html
    """

    STATUS_UNKNOWN: ClassVar[int8] = 0
    """Indicates status has not been properly set."""
    STATUS_ACCEPTED: ClassVar[int8] = 1
    """The goal has been accepted and is awaiting execution."""
    STATUS_EXECUTING: ClassVar[int8] = 2
    """The goal is currently being executed by the action server."""
    STATUS_CANCELING: ClassVar[int8] = 3
    """The client has requested that the goal be canceled and the action server has
    accepted the cancel request.
    """
    STATUS_SUCCEEDED: ClassVar[int8] = 4
    """The goal was achieved successfully by the action server."""
    STATUS_CANCELED: ClassVar[int8] = 5
    """The goal was canceled after an external request from an action client."""
    STATUS_ABORTED: ClassVar[int8] = 6
    """The goal was terminated by the action server without an external request."""

    goal_info: GoalInfo = GoalInfo()
    """Goal info (contains ID and timestamp)."""
    status: int8 = 0
    """Action goal state-machine status."""


class GoalStatusArray(Message, package="action_msgs"):
    """An array of goal statuses."""

    status_list: Sequence[GoalStatus] = ()


class CancelGoal(ServiceType, package="action_msgs"):
    """Cancel one or more goals with the following policy:

    - If the goal ID is zero and timestamp is zero, cancel all goals.
    - If the goal ID is zero and timestamp is not zero, cancel all goals accepted
      at or before the timestamp.
    - If the goal ID is not zero and timestamp is zero, cancel the goal with the
      given ID regardless of the time it was accepted.
    - If the goal ID is not zero and timestamp is not zero, cancel the goal with
      the given ID and all goals accepted at or before the timestamp.
    """

    class Request(Message):
        """The request."""

        goal_info: GoalInfo = GoalInfo()
        """Goal info describing the goals to cancel, see above."""

    class Response(Message):
        """Return codes."""

        ERROR_NONE: ClassVar[int8] = 0
        """Indicates the request was accepted without any errors.

        One or more goals have transitioned to the CANCELING state. The
        goals_canceling list is not empty.
        """
        ERROR_REJECTED: ClassVar[int8] = 1
        """Indicates the request was rejected.

        No goals have transitioned to the CANCELING state. The goals_canceling list is
        empty.
        """
        ERROR_UNKNOWN_GOAL_ID: ClassVar[int8] = 2
        """Indicates the requested goal ID does not exist.

        No goals have transitioned to the CANCELING state. The goals_canceling list is
        empty.
        """
        ERROR_GOAL_TERMINATED: ClassVar[int8] = 3
        """Indicates the goal is not cancelable because it is already in a terminal state.

        No goals have transitioned to the CANCELING state. The goals_canceling list is
        empty.
        """

        return_code: int8 = 0
        """Return code, see above definitions."""
        goals_canceling: Sequence[GoalInfo] = ()
        """Goals that accepted the cancel request."""
