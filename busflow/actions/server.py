"""ActionServer: takes goals, runs a handler for each, and ends each exactly once."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Collection, Coroutine
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from busflow.actions.endpoints import REJECTED, GoalServer, ResultServer, StatusPublisher
from busflow.actions.goal import GoalState, RunningGoal
from busflow.actions.identifiers import from_message, key_of
from busflow.actions.open_goals import OpenGoals, WhenBusy
from busflow.actions.results import Results
from busflow.bus.failure import is_failure
from busflow.bus.services.call import set_activity
from busflow.clock import NS_PER_S, Clock, nanoseconds_of
from busflow.errors import IncompatibleType, NotRunning, ServiceUnavailable
from busflow.interfaces.action import ActionType, DerivedTypes
from busflow.interfaces.message import Message, shown_value, type_name
from busflow.msgs.action_msgs import CancelGoal, GoalInfo, GoalStatusArray
from busflow.msgs.builtin_interfaces import Time
from busflow.text import printable
from busflow.validation.tracebacks import line, reason

if TYPE_CHECKING:
    from uuid import UUID

    from busflow.actions.statistics import GoalServerStatistics
    from busflow.bus.publisher import Publisher
    from busflow.bus.services.server import Server
    from busflow.node.lifetime import NodeLifetime

A = TypeVar("A")

Handler = Callable[[Any], Coroutine[Any, Any, Any]]
Accepts = Callable[[Any], object]
CANCEL_WITHIN_S = 2.0
"""The default time within which a handler should end after a cancel."""


@dataclass(frozen=True, slots=True)
class ServerOptions:
    """The options of `@action`."""

    when_busy: WhenBusy
    at_most: int
    cancel_within_s: float


@dataclass(frozen=True, slots=True)
class ServerEndpoints:
    """The endpoints of an action's server."""

    goals: GoalServer
    cancels: Server[Any, Any]
    results: ResultServer
    feedback: Publisher[Any]
    status: StatusPublisher


class ActionServer(Generic[A]):
    """The server of an action; on a node it is the attribute below `@action`."""

    def __init__(
        self,
        name: str,
        action_type: type[ActionType],
        types: DerivedTypes,
        options: ServerOptions,
        *,
        handler: Handler,
        accepts: Accepts | None,
        life: NodeLifetime,
        clock: Clock,
    ) -> None:
        """Create a server; its endpoints are created after it, with its methods as handlers, and set."""
        self.endpoints: ServerEndpoints
        self.action: str = name
        """The action's final name."""
        self.open_goals: OpenGoals = OpenGoals(options.when_busy, options.at_most)
        """The goals that have not ended."""
        self._type, self._types, self._options = action_type, types, options
        self._handler, self._accepts = handler, accepts
        self._life, self._log, self._clock = life, life.log, clock
        self._active: dict[bytes, RunningGoal[Any]] = {}
        self._idle: list[asyncio.Future[RunningGoal[Any]]] = []
        """The next goals of tasks that have none, one future for each."""
        self._results = Results(clock)

    @property
    def goals(self) -> tuple[RunningGoal[A], ...]:
        """The goals that have not ended, in the order they came."""
        return tuple(self._active.values())

    def statistics(self) -> GoalServerStatistics:
        """Return the server's current counts."""
        return self.endpoints.goals.statistics()

    # What the server of results asks for.

    @property
    def active(self) -> Collection[RunningGoal[Any]]:
        """The goals that have not ended."""
        return self._active.values()

    def find(self, key: bytes) -> RunningGoal[Any] | None:
        """Return a goal that has not ended, or that ended lately, by `key_of` its identifier."""
        return self._active.get(key) or self._results.goal(key)

    # Goals that come.

    def on_goal(self, request: Any) -> Message:
        """Answer a request of `send_goal`: accept the goal, or reject it and say why."""
        stamp = self._clock.now().to_msg()
        response: Any = self._types.send_goal.Response
        refusal = self._refusal(request)
        if refusal is not None:
            self.endpoints.goals.outcomes[REJECTED] += 1
            self.endpoints.goals.remark(refusal)
            self._log.info(f"a goal of {self.action} is rejected: {refusal}")
            return response(accepted=False, stamp=stamp)
        goal: RunningGoal[Any] = RunningGoal(self, request, client=self.endpoints.goals.caller, stamp=stamp)
        replaced = self.open_goals.replaced()
        self._active[goal.key] = goal
        self.open_goals.waiting.append(goal)
        for each in replaced:
            self._ask_to_end(each, GoalState.ABORTED, f"superseded by the goal {goal.id}")
        self._begin_next()
        if goal.state is GoalState.ACCEPTED:
            self.endpoints.status.change()
        return response(accepted=True, stamp=stamp)

    def _refusal(self, request: Any) -> str | None:
        """Return why a goal is rejected, or None."""
        goal: Message = request.goal
        if self.find(key_of(request.goal_id)) is not None:
            return f"a goal with the identifier {from_message(request.goal_id)} was sent already"
        if self._accepts is not None:
            try:
                answer = self._accepts(goal)
            except Exception as error:  # noqa: BLE001  # a node's own code may raise anything; the client gets it
                self.endpoints.goals.report(error, goal)
                return printable(reason(error), limit=400)
            if answer is not True:
                return printable(answer, limit=400) if isinstance(answer, str) else "its node does not accept it"
        return self.open_goals.refusal()

    def _begin_next(self) -> None:
        """Run the next goal that waits, if there is room: one has come, or one has ended."""
        goal = self.open_goals.next()
        if goal is None:
            return
        goal.state = GoalState.EXECUTING
        self.endpoints.status.change()
        if self._idle:
            self._idle.pop().set_result(goal)
        else:
            self._life.spawn(self._run_goals(goal), self.action)

    # Goals that run.

    async def _run_goals(self, goal: RunningGoal[Any]) -> None:
        """Run a goal and then others, since a new task would cost more than the rest of a goal; a cancel ends it."""
        await self._run(goal)
        while goal.ending is None:
            self._idle.append(following := asyncio.get_running_loop().create_future())
            goal = await following
            await self._run(goal)

    async def _run(self, goal: RunningGoal[Any]) -> None:
        """Call the handler for a goal."""
        if goal.ending is not None:  # a task that is cancelled before its first step would never take it
            self.finish(goal, goal.ending, goal.reason)
            return
        goal.task = asyncio.current_task()
        try:
            set_activity(goal.activity)  # of a task that runs nothing but goals
            goal.handling = self._handler(goal)
            result = await goal.handling
            if result is not None or goal.ending is None:
                self._check_result(result)
        except asyncio.CancelledError as error:
            if goal.ending is None and is_failure(error):  # the handler raised it by itself
                self.finish(goal, GoalState.ABORTED, "its handler raised CancelledError")
            elif goal.ending is None or goal.state.is_terminal:  # not the goal but its node ends
                raise
            else:
                self.finish(goal, goal.ending, goal.reason)
        except Exception as error:  # noqa: BLE001  # a handler may raise anything; its client gets it, and the node goes on
            self.endpoints.goals.report(error, goal.request)
            self.finish(goal, GoalState.ABORTED, printable(reason(error), limit=400))
        except BaseException as error:
            if is_failure(error):
                self.finish(goal, GoalState.ABORTED, printable(reason(error), limit=400))
            raise
        else:
            self.finish(goal, goal.ending or GoalState.SUCCEEDED, goal.reason, result)

    def _check_result(self, result: object) -> None:
        if type(result) is not self._type.Result:
            wanted = type_name(self._type.Result)
            origin = self.endpoints.goals.endpoint.origin
            raise IncompatibleType(f"{origin} must return a {wanted}, not {shown_value(result)}")

    def publish_feedback(self, goal: RunningGoal[Any], feedback: Message) -> None:
        """Publish feedback on a goal that runs."""
        if type(feedback) is not self._type.Feedback:
            wanted = type_name(self._type.Feedback)
            raise IncompatibleType(f"feedback of {self.action} is a {wanted}, not {shown_value(feedback)}")
        if goal.state.is_terminal:
            raise NotRunning(f"the goal {goal.id} of {self.action} has ended: it gets no feedback any more")
        goal.feedback_count += 1
        message: Any = self._types.feedback
        self.endpoints.feedback.publish(message(goal_id=goal.goal_id, feedback=feedback))

    # Goals that end.

    def finish(self, goal: RunningGoal[Any], state: GoalState, why: str = "", result: Message | None = None) -> None:
        """End a goal: set its state, answer those that wait for it, and begin the next one; only the first end counts.

        Args:
            goal: The goal.
            state: A terminal state.
            why: The reason, in words; empty for success.
            result: The handler's result; by default one with default values.
        """
        if goal.response is not None:
            return
        goal.state, goal.reason = state, why
        goal.task = goal.handling = None
        del self._active[goal.key]
        self.open_goals.remove(goal)
        self.endpoints.goals.outcomes[state] += 1
        response: Any = self._types.get_result.Response
        goal.response = response(status=int(state), result=self._type.Result() if result is None else result)
        self._results.keep(goal)
        self.endpoints.status.change()
        self.endpoints.results.answer(goal)
        self._begin_next()

    def _ask_to_end(self, goal: RunningGoal[Any], state: GoalState, why: str) -> None:
        """Make a goal end in this state: at once if it waits, by cancelling its handler if it runs."""
        if goal.ending is not None:
            return
        goal.ending, goal.reason = state, why
        if goal.state is GoalState.ACCEPTED:
            self.finish(goal, state, why)
            return
        if state is GoalState.CANCELED:
            goal.state = GoalState.CANCELING
            self.endpoints.status.change()
        if goal.task is not None:
            goal.task.cancel()
        within_ns = round(self._options.cancel_within_s * NS_PER_S)
        self._clock.call_at(self._clock.monotonic_ns() + within_ns, partial(self._warn_of, goal))

    def _warn_of(self, goal: RunningGoal[Any]) -> None:
        """Log where a handler is that has not ended in time."""
        if goal.state.is_terminal or goal.task is None:
            return
        frame = getattr(goal.handling, "cr_frame", None)
        place = None if frame is None else line(frame.f_code.co_filename, frame.f_lineno)
        self._log.warning(
            f"the handler of {self.action} goes on {self._options.cancel_within_s:g} s after its goal was canceled"
            f"{f', at {place}' if place else ''}: let CancelledError pass, or return a result",
            goal=str(goal.id),
        )

    def on_cancel(self, request: CancelGoal.Request) -> CancelGoal.Response:
        """Answer a request of `cancel_goal`: one goal, or all, or those accepted up to a time, as ROS 2 has it."""
        goal_id, until = from_message(request.goal_info.goal_id), request.goal_info.stamp
        chosen = [each for each in self.goals if _is_meant(each, goal_id, until)]
        if not chosen and goal_id.int and until == Time():
            known = self._results.goal(goal_id.bytes)
            code = CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID
            return CancelGoal.Response(return_code=code if known is None else CancelGoal.Response.ERROR_GOAL_TERMINATED)
        for goal in chosen:
            self._cancel(goal)
        infos = tuple(each.info for each in chosen)
        code = CancelGoal.Response.ERROR_NONE if infos else CancelGoal.Response.ERROR_REJECTED
        return CancelGoal.Response(return_code=code, goals_canceling=infos)

    def cancel_all_of(self, client: str) -> None:
        """Cancel the goals of a client that has gone, each by a request in its name, so that a recording has it."""
        for waiting in [each for each in self.endpoints.goals.items if each.caller == client]:
            self.endpoints.goals.withdraw(waiting)
            waiting.fail(ServiceUnavailable(f"{client} has gone"))
        for goal in self.goals:
            if goal.client == client:
                goal.client_gone = True
                request = CancelGoal.Request(goal_info=GoalInfo(goal_id=goal.goal_id))
                call = self.endpoints.cancels.ask(request, caller=client)
                call.reply.add_done_callback(partial(self._cancel_unasked, goal))

    def _cancel_unasked(self, goal: RunningGoal[Any], _reply: object) -> None:
        """Cancel a goal, if there was no room for the request."""
        if not goal.state.is_terminal:
            self._cancel(goal)

    def _cancel(self, goal: RunningGoal[Any]) -> None:
        self._ask_to_end(goal, GoalState.CANCELED, "its client has gone" if goal.client_gone else "")

    def close(self) -> None:
        """End every goal, because the node ends; the tasks of their handlers are cancelled with the node's."""
        for goal in (*self.open_goals.waiting, *self.open_goals.running):  # in this order none that waits begins
            self.finish(goal, GoalState.ABORTED, f"{self._life.name} has ended")
        self.endpoints.status.keep()  # for the node's next start, whose server knows none of these goals

    def statuses(self) -> GoalStatusArray:
        """Return the states of all goals, those that ended lately among them."""
        active = [each.status for each in self._active.values()]
        return GoalStatusArray(status_list=(*self._results.statuses, *active))


def _is_meant(goal: RunningGoal[Any], goal_id: UUID, until: Time) -> bool:
    """Return whether a request to cancel means a goal; zeros stand for any identifier, and for any time."""
    if until == Time():
        return not goal_id.int or goal.id == goal_id
    return goal.id == goal_id or nanoseconds_of(goal.stamp) <= nanoseconds_of(until)
