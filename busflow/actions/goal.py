"""Goal: one goal as its server holds it, and its states."""

from __future__ import annotations

import asyncio
from enum import IntEnum
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar, cast

from busflow.actions.identifiers import from_message, key_of
from busflow.bus.services.call import Activity, Call
from busflow.interfaces.message import Message
from busflow.msgs.action_msgs import GoalInfo, GoalStatus

if TYPE_CHECKING:
    from collections.abc import Coroutine
    from uuid import UUID

    from busflow.msgs import unique_identifier_msgs
    from busflow.msgs.builtin_interfaces import Time

G_co = TypeVar("G_co", bound=Message, covariant=True)
R_co = TypeVar("R_co", bound=Message, covariant=True)
F_co = TypeVar("F_co", bound=Message, covariant=True)
G = TypeVar("G", bound=Message)
R = TypeVar("R", bound=Message)
F = TypeVar("F", bound=Message)
A_co = TypeVar("A_co", covariant=True)


class Parts(Protocol[G_co, R_co, F_co]):
    """The three messages of an action type, for type checkers."""

    @property
    def Goal(self) -> type[G_co]: ...  # noqa: D102, N802  # the class inside an action type
    @property
    def Result(self) -> type[R_co]: ...  # noqa: D102, N802  # the same
    @property
    def Feedback(self) -> type[F_co]: ...  # noqa: D102, N802  # the same


class GoalState(IntEnum):
    """The state of a goal, as `action_msgs/msg/GoalStatus` numbers it."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def is_terminal(self) -> bool:
        """True if the goal has ended."""
        return self >= GoalState.SUCCEEDED


class FeedbackTaker(Protocol):
    """The server of a goal, as the goal uses it."""

    @property
    def action(self) -> str:
        """The action's final name."""
        ...

    def publish_feedback(self, goal: RunningGoal[Any], feedback: Message) -> None:
        """Publish feedback on a goal."""
        ...


class RunningGoal(Generic[A_co]):
    """A goal that a server has accepted: what its handler is called with.

    Write `async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result` below `@action(MoveTo, "~/move")`.
    """

    __slots__ = (
        "_goal", "_server", "_status", "activity", "asked", "client", "client_gone", "ending", "feedback_count",
        "goal_id", "handling", "key", "reason", "response", "stamp", "state", "task",
    )  # fmt: skip

    def __init__(self, server: FeedbackTaker, request: Any, *, client: str, stamp: Time) -> None:
        """Create the goal of a request of `send_goal`, which was just accepted."""
        self.client: str = client
        """The full name of the client's node, or `another process`."""
        self.client_gone: bool = False
        """True once that node is known to have gone."""
        self.goal_id: unique_identifier_msgs.UUID = request.goal_id
        """Its identifier, as ROS 2's message."""
        self.stamp: Time = stamp
        """The time at which it was accepted."""
        self.key: bytes = key_of(self.goal_id)
        """What it is looked up by."""
        self.state: GoalState = GoalState.ACCEPTED
        """The goal's state now."""
        self.ending: GoalState | None = None
        """The state in which it will end, once that was asked for: CANCELED, or ABORTED where one replaces it."""
        self.reason: str = ""
        """Why it ended, in words; empty where its state says all."""
        self.task: asyncio.Task[Any] | None = None
        """The task of its handler, once that has begun."""
        self.handling: Coroutine[Any, Any, Any] | None = None
        """The call of its handler, once that has begun."""
        self.feedback_count: int = 0
        """How many feedback messages were published on it."""
        self.activity: Activity = Activity(f"a goal of {server.action}")
        """The activity of its handler, for which others may wait."""
        self.asked: list[Call[Any, Any]] = []
        """The calls that wait for its result."""
        self.response: Message | None = None
        """The answer to them, once it has ended."""
        self._goal: Message = request.goal
        self._server = server
        self._status: GoalStatus | None = None

    @property
    def id(self) -> UUID:
        """The goal's identifier, which its client has chosen."""
        return from_message(self.goal_id)

    @property
    def info(self) -> GoalInfo:
        """Its identifier and the time at which it was accepted, as ROS 2's message."""
        return GoalInfo(goal_id=self.goal_id, stamp=self.stamp)

    @property
    def request(self: RunningGoal[Parts[G, Any, Any]]) -> G:
        """The goal itself, the `Goal` of the action type."""
        return cast("G", self._goal)

    @property
    def status(self) -> GoalStatus:
        """The goal's state now, as ROS 2's message."""
        known = self._status
        if known is None or known.status != self.state:
            known = self._status = GoalStatus(goal_info=self.info, status=int(self.state))
        return known

    @property
    def is_canceling(self) -> bool:
        """True from a cancel on: for a handler whose work runs in a thread."""
        return self.ending is not None

    def feedback(self: RunningGoal[Parts[Any, Any, F]], feedback: F) -> None:
        """Publish how far the goal is; its client gets all of it in order, as far as its depth reaches.

        Raises:
            IncompatibleType: it is no `Feedback` of the action type.
            NotRunning: the goal has ended.
        """
        self._server.publish_feedback(self, feedback)

    def __repr__(self) -> str:
        return f"<RunningGoal {self.id} of {self.client}: {self.state.name}>"
