"""Endpoints of an action's services that know goals, and account for them; the other endpoints are plain ones."""

from __future__ import annotations

from collections import Counter
from dataclasses import asdict, replace
from typing import TYPE_CHECKING, Any, Protocol

from busflow.actions.goal import GoalState, RunningGoal
from busflow.actions.identifiers import key_of
from busflow.actions.statistics import GoalClientStatistics, GoalServerStatistics
from busflow.bus.publisher import Publisher
from busflow.bus.services.client import Client
from busflow.bus.services.server import RequestHandler, Server
from busflow.errors import ServiceGone
from busflow.msgs.action_msgs import GoalStatusArray

if TYPE_CHECKING:
    from collections.abc import Callable, Collection

    from busflow.actions.open_goals import OpenGoals
    from busflow.bus.endpoint import Endpoint, ServiceEndpoint
    from busflow.bus.services.call import Activity, Call
    from busflow.bus.statistics import ServerStatistics
    from busflow.interfaces.message import Message, ServiceType

REJECTED = "rejected"
LEFT = "left"
LOST = "lost"
"""Outcomes of goals besides the terminal states."""


class GoalServer(Server[Any, Any]):
    """The server of `send_goal`, whose account is the action's."""

    __slots__ = ("forget", "open_goals", "outcomes")

    def __init__(
        self,
        service_type: type[ServiceType],
        endpoint: ServiceEndpoint,
        handler: RequestHandler[Any, Any],
        open_goals: OpenGoals,
    ) -> None:
        """Create the server of an action, whose statistics count these goals too."""
        super().__init__(service_type, endpoint, handler)
        self.open_goals: OpenGoals = open_goals
        self.outcomes: Counter[str | GoalState] = Counter()
        """The number of goals by outcome."""
        self.forget: Callable[[str], None] = lambda _client: None
        """Called with the name of a client that has gone."""

    @property
    def caller(self) -> str:
        """The full name of the client whose request is being answered."""
        return "" if self._serving is None else self._serving.caller

    def remark(self, text: str) -> None:
        """Say something beside the answer to the request that is being answered."""
        if self._serving is not None:
            self._serving.remark = text

    def report(self, error: BaseException, goal: Message) -> None:
        """Log what the handler of a goal raised, as the exception of a service's handler is."""
        if self._on_error is not None:
            self._on_error(error, goal)

    def statistics(self) -> GoalServerStatistics:
        """Return the server's current counts."""
        requests = super().statistics()
        return GoalServerStatistics(
            **asdict(requests),
            rejected=self.outcomes[REJECTED] + requests.failed + requests.refused + requests.withdrawn + requests.lost,
            succeeded=self.outcomes[GoalState.SUCCEEDED],
            aborted=self.outcomes[GoalState.ABORTED],
            canceled=self.outcomes[GoalState.CANCELED],
            running=len(self.open_goals.running),
            queued=len(self.open_goals.waiting) + requests.waiting,
        )


class Goals(Protocol):
    """The goals of an action's server, as the server of their results uses them."""

    @property
    def active(self) -> Collection[RunningGoal[Any]]:
        """The goals that have not ended."""
        ...

    def find(self, key: bytes) -> RunningGoal[Any] | None:
        """Return a goal that has not ended, or that ended lately, by `key_of` its identifier."""
        ...

    def close(self) -> None:
        """End every goal, because the node ends."""
        ...


class ResultServer(Server[Any, Any]):
    """The server of `get_result`: it answers each request when its goal has ended, in any order."""

    __slots__ = ("_goals", "_open_goals")
    received: int
    served: int
    withdrawn: int
    lost: int

    def __init__(
        self, service_type: type[ServiceType], endpoint: ServiceEndpoint, goals: Goals, open_goals: OpenGoals
    ) -> None:
        """Create the server of the results of these goals."""
        super().__init__(service_type, endpoint, _answered_otherwise)
        self._goals: Goals = goals
        self._open_goals: OpenGoals = open_goals

    def accept(self, call: Call[Any, Any]) -> None:
        """Take a call: it is answered now if its goal has ended, or is unknown."""
        self.received += 1
        goal = self._goals.find(key_of(call.request.goal_id))
        if goal is not None and goal.response is None:
            goal.asked.append(call)
            return
        self.served += 1
        response: Any = self.type.Response() if goal is None else goal.response
        call.remark = "" if goal is None else goal.reason
        call.succeed(response)

    def answer(self, goal: RunningGoal[Any]) -> None:
        """Answer all calls that wait for a goal, which has ended."""
        for call in goal.asked:
            self.served += 1
            call.remark = goal.reason
            call.succeed(goal.response)
        goal.asked.clear()

    def feedback_count(self, call: Call[Any, Any]) -> int:
        """Return how many feedback messages were published on the goal of a call."""
        goal = self._goals.find(key_of(call.request.goal_id))
        return 0 if goal is None else goal.feedback_count

    def withdraw(self, call: Call[Any, Any]) -> None:
        """Drop a call whose caller no longer waits; its goal goes on."""
        goal = self._goals.find(key_of(call.request.goal_id))
        if goal is not None and call in goal.asked:
            goal.asked.remove(call)
            self.withdrawn += 1

    def holder(self, call: Call[Any, Any]) -> Activity | None:
        """Return the activity of the goal that is asked for, or of the goal before it."""
        goal = self._goals.find(key_of(call.request.goal_id))
        ahead = None if goal is None or goal.response is not None else self._open_goals.ahead_of(goal)
        return None if ahead is None else ahead.activity

    def close(self) -> None:
        """Stop answering for good; every waiting call fails at once with `ServiceGone`, and every goal ends."""
        for goal in self._goals.active:
            for call in goal.asked:
                self.lost += 1
                call.fail(ServiceGone(f"{self.service}: its server {self.node} ended before the goal {goal.id} had"))
            goal.asked.clear()
        self._goals.close()
        super().close()

    def statistics(self) -> ServerStatistics:
        """Return the server's current counts."""
        waiting = sum(len(goal.asked) for goal in self._goals.active)
        return replace(super().statistics(), waiting=waiting)


class StatusPublisher(Publisher[GoalStatusArray]):
    """The publisher of `status`: while nothing receives it, a message is made only for a late joiner."""

    __slots__ = ("_has_changed", "_statuses", "_watched")

    def __init__(self, endpoint: Endpoint, statuses: Callable[[], GoalStatusArray]) -> None:
        """Create the publisher of the states that `statuses` returns."""
        super().__init__(GoalStatusArray, endpoint)
        qos = endpoint.qos
        self._statuses = statuses
        self._watched = any(each is not None for each in (qos.deadline_s, qos.lease_s, qos.lifespan_s))
        self._has_changed = False
        """True if a change was published without a message."""

    def change(self) -> None:
        """Publish the states as they are now."""
        topic = self._topic
        if topic is None or topic.pushes or self._outlet or self._watched or self.on_first is not None:
            self._has_changed = False
            self.publish(self._statuses())
        else:
            self._has_changed = True
            self.published: int = self.published + 1

    def keep(self) -> None:
        """Make the message of the last change, if there is none."""
        if self._has_changed and self._history is not None:
            self._has_changed = False
            self._history.append((self.published, self._statuses()))

    @property
    def history(self) -> tuple[tuple[int, Any], ...]:
        """The last states, for late joiners."""
        self.keep()
        return super().history


def _answered_otherwise(_request: Message) -> Message:
    """Stand in for the handler, which a server must have; `accept` puts nothing into its queue."""
    raise NotImplementedError


class GoalClient(Client[Any, Any]):
    """The client of `send_goal`, whose account is the action's."""

    __slots__ = ("feedback_dropped", "outcomes", "running")

    def __init__(self, service_type: type[ServiceType], endpoint: ServiceEndpoint) -> None:
        """Create the client of an action."""
        super().__init__(service_type, endpoint)
        self.outcomes: Counter[str | GoalState] = Counter()
        """The number of goals by outcome."""
        self.feedback_dropped: int = 0
        self.running: int = 0

    def statistics(self) -> GoalClientStatistics:
        """Return the client's current counts."""
        return GoalClientStatistics(
            **asdict(super().statistics()),
            rejected=self.outcomes[REJECTED],
            succeeded=self.outcomes[GoalState.SUCCEEDED],
            aborted=self.outcomes[GoalState.ABORTED],
            canceled=self.outcomes[GoalState.CANCELED],
            left=self.outcomes[LEFT],
            lost=self.outcomes[LOST],
            running=self.running,
            feedback_dropped=self.feedback_dropped,
        )
