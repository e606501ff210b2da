"""ROS 2's action `example_interfaces/action/Fibonacci` as a program of DDS alone declares it: nothing of busflow."""

# Without `from __future__ import annotations`: cyclonedds reads the annotations of a class where it is made.

from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, int8, int32, int64, sequence, uint8, uint64
from ros2_types import Time

Numbers = sequence[int32]


@dataclass
class Uuid(IdlStruct, typename="unique_identifier_msgs::msg::dds_::UUID_"):
    uuid: array[uint8, 16] = (0,) * 16


@dataclass
class GoalInfo(IdlStruct, typename="action_msgs::msg::dds_::GoalInfo_"):
    goal_id: Uuid = field(default_factory=Uuid)
    stamp: Time = field(default_factory=Time)


@dataclass
class GoalStatus(IdlStruct, typename="action_msgs::msg::dds_::GoalStatus_"):
    goal_info: GoalInfo = field(default_factory=GoalInfo)
    status: int8 = 0


@dataclass
class States(IdlStruct, typename="action_msgs::msg::dds_::GoalStatusArray_"):
    status_list: sequence[GoalStatus] = ()


@dataclass
class Goal(IdlStruct, typename="example_interfaces::action::dds_::Fibonacci_Goal_"):
    order: int32 = 0


@dataclass
class Result(IdlStruct, typename="example_interfaces::action::dds_::Fibonacci_Result_"):
    sequence: Numbers = ()


@dataclass
class Progress(IdlStruct, typename="example_interfaces::action::dds_::Fibonacci_Feedback_"):
    sequence: Numbers = ()


@dataclass
class Feedback(IdlStruct, typename="example_interfaces::action::dds_::Fibonacci_FeedbackMessage_"):
    goal_id: Uuid = field(default_factory=Uuid)
    feedback: Progress = field(default_factory=Progress)


# A request and its reply begin with two fields of the middleware.


@dataclass
class SendRequest(IdlStruct, typename="example_interfaces::action::dds_::Fibonacci_SendGoal_Request_"):
    guid: uint64 = 0
    seq: int64 = 0
    goal_id: Uuid = field(default_factory=Uuid)
    goal: Goal = field(default_factory=Goal)


@dataclass
class SendReply(IdlStruct, typename="example_interfaces::action::dds_::Fibonacci_SendGoal_Response_"):
    guid: uint64 = 0
    seq: int64 = 0
    accepted: bool = False
    stamp: Time = field(default_factory=Time)


@dataclass
class ResultRequest(IdlStruct, typename="example_interfaces::action::dds_::Fibonacci_GetResult_Request_"):
    guid: uint64 = 0
    seq: int64 = 0
    goal_id: Uuid = field(default_factory=Uuid)


@dataclass
class ResultReply(IdlStruct, typename="example_interfaces::action::dds_::Fibonacci_GetResult_Response_"):
    guid: uint64 = 0
    seq: int64 = 0
    status: int8 = 0
    result: Result = field(default_factory=Result)


@dataclass
class CancelRequest(IdlStruct, typename="action_msgs::srv::dds_::CancelGoal_Request_"):
    guid: uint64 = 0
    seq: int64 = 0
    goal_info: GoalInfo = field(default_factory=GoalInfo)


@dataclass
class CancelReply(IdlStruct, typename="action_msgs::srv::dds_::CancelGoal_Response_"):
    guid: uint64 = 0
    seq: int64 = 0
    return_code: int8 = 0
    goals_canceling: sequence[GoalInfo] = ()


SERVICES = {
    "send_goal": (SendRequest, SendReply),
    "cancel_goal": (CancelRequest, CancelReply),
    "get_result": (ResultRequest, ResultReply),
}
TOPICS = {"feedback": Feedback, "status": States}
