"""ActionClient: sends goals, and waits for their results; a `SentGoal` is one of them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, Self, TypeVar, cast

from busflow.actions.endpoints import LEFT, LOST, REJECTED, GoalClient
from busflow.actions.feedback import DEPTH, FeedbackQueue, wake
from busflow.actions.goal import F, G, GoalState, Parts, R
from busflow.actions.identifiers import Identifiers, from_message, key_of
from busflow.bus.services.call import Call, waited
from busflow.bus.services.client import TIMEOUT_S, Client, check_timeout
from busflow.clock import NS_PER_S, Clock
from busflow.errors import (
    ActionError,
    ActionGone,
    ActionUnavailable,
    BusflowError,
    GoalAborted,
    GoalCanceled,
    GoalRejected,
    GoalTimeout,
    IncompatibleType,
    NotRunning,
    ServiceError,
    ServiceGone,
    ServiceTimeout,
    ServiceUnavailable,
)
from busflow.interfaces.action import ActionType, DerivedTypes
from busflow.interfaces.message import Message, shown_value, type_name
from busflow.msgs.action_msgs import CancelGoal, GoalInfo

if TYPE_CHECKING:
    from types import TracebackType
    from uuid import UUID

    from busflow.actions.statistics import GoalClientStatistics
    from busflow.bus.subscription import Subscription

A = TypeVar("A")


@dataclass(frozen=True, slots=True)
class ClientEndpoints:
    """The endpoints of an action's client."""

    goals: GoalClient
    cancels: Client[Any, Any]
    results: Client[Any, Any]
    feedback: Subscription[Any]


class ActionClient(Generic[A]):
    """A client of an action."""

    def __init__(
        self, name: str, action_type: type[ActionType], types: DerivedTypes, clock: Clock, identifiers: Identifiers
    ) -> None:
        """Create a client; its endpoints are created after it, with `on_feedback` as a handler, and set."""
        self.endpoints: ClientEndpoints
        self.action: str = name
        """The action's final name."""
        self.type: type[ActionType] = action_type
        self.types: DerivedTypes = types
        self.clock: Clock = clock
        self.identifiers: Identifiers = identifiers
        self.sent: dict[bytes, SentGoal[Any]] = {}
        """The goals whose feedback is wanted, by the bytes of their identifiers."""

    @property
    def available(self) -> bool:
        """Whether the action has a server now."""
        return self.endpoints.goals.available and self.endpoints.cancels.available and self.endpoints.results.available

    async def ready(self, *, timeout: float | None = TIMEOUT_S) -> bool:  # noqa: ASYNC109  # by the run's clock, as Client.ready
        """Wait until the action has a server, and return True.

        Raises:
            ActionUnavailable: no server came in time.
        """
        try:
            for client in (self.endpoints.goals, self.endpoints.cancels, self.endpoints.results):
                await client.ready(timeout=timeout)
        except ServiceUnavailable:
            raise self.unavailable() from None
        return True

    async def run(
        self: ActionClient[Parts[G, R, F]],
        goal: G,
        *,
        timeout: float | None = None,  # noqa: ASYNC109  # as above
        on_feedback: Callable[[F], object] | None = None,
    ) -> R:
        """Send a goal, wait until it has ended, and return its result.

        If the caller is cancelled or times out, the goal is canceled.

        Args:
            goal: The goal.
            timeout: Seconds of the run's clock for all of it, or None for no limit.
            on_feedback: Called with each feedback.

        Raises:
            ActionUnavailable: the action has no server, or its server has no room.
            GoalRejected: the server does not take the goal.
            GoalAborted: the server gave it up; `error.result` is what it sent.
            GoalCanceled: it was canceled.
            ActionGone: the server's node ended before.
            GoalTimeout: it did not end in time.
            DeadlockError: the server waits, directly or through others, for the caller.
            IncompatibleType: the goal is of another type.
        """
        async with self.send(goal, timeout=timeout) as sent:
            if on_feedback is not None:
                async for feedback in sent:
                    on_feedback(feedback)
            return await sent.result()

    def send(
        self: ActionClient[Parts[G, R, F]],
        goal: G,
        *,
        timeout: float | None = None,  # as above
        depth: int = DEPTH,
    ) -> SentGoal[Parts[G, R, F]]:
        """Send a goal that lasts as long as a block: `async with self.move.send(goal) as going`.

        Leaving the block in any way cancels the goal if it has not ended. The block begins when the goal is accepted.

        Args:
            goal: The goal.
            timeout: As for `run`.
            depth: How many feedback messages may wait for `async for`; a full queue drops the oldest.

        Raises:
            IncompatibleType: the goal is of another type.
        """
        check_timeout(timeout)
        if type(goal) is not self.type.Goal:
            origin, wanted = self.endpoints.goals.endpoint.origin, type_name(self.type.Goal)
            raise IncompatibleType(f"{origin} sends {self.action} a {wanted}, not {shown_value(goal)}")
        return SentGoal(self, goal, timeout_s=timeout, depth=depth)

    def on_feedback(self, message: Any) -> None:
        """Pass feedback to the goal that it is for; that of other clients' goals is not wanted."""
        sent = self.sent.get(key_of(message.goal_id))
        if sent is not None:
            sent.push(message.feedback)

    def unavailable(self) -> ActionUnavailable:
        """Return the error of an action without a server."""
        return ActionUnavailable(f"{self.action} has no server; start a node that serves it")

    def statistics(self) -> GoalClientStatistics:
        """Return the client's current counts."""
        return self.endpoints.goals.statistics()

    def __repr__(self) -> str:
        goals = self.endpoints.goals
        return f"<ActionClient {self.action} of {goals.endpoint.node}: {goals.running} running>"


class SentGoal(Generic[A]):
    """A goal that a client has sent: an async context manager, and an iterator over its feedback.

    Made by `ActionClient.send`. Iterating ends when the goal does; `result` then returns or raises at once.
    """

    def __init__(self, client: ActionClient[Any], goal: Message, *, timeout_s: float | None, depth: int) -> None:
        self._id_message = client.identifiers.draw()
        self._client, self._goal, self._timeout_s = client, goal, timeout_s
        self._feedback = FeedbackQueue(depth, client.clock)
        self._key = key_of(self._id_message)
        self._asked: Call[Any, Any] | None = None
        self._limit: asyncio.TimerHandle | None = None
        self._is_sent = self._has_ended = False
        self._result: Any = None
        """The result, or the error in its place, once the goal has ended."""
        self._waiting: list[asyncio.Future[None]] = []
        """One future for each task that waits for the end."""

    @property
    def id(self) -> UUID:
        """The goal's identifier."""
        return from_message(self._id_message)

    async def __aenter__(self) -> Self:
        if self._is_sent:
            raise NotRunning(f"the goal {self.id} was sent already; send another one")
        client, self._is_sent = self._client, True
        client.sent[self._key] = self
        client.endpoints.goals.running += 1
        try:
            await self._send()
        except BaseException as error:
            self._close(REJECTED if isinstance(error, GoalRejected) else LOST if _is_lost(error) else LEFT)
            raise
        request: Any = client.types.get_result.Request
        self._asked = call = client.endpoints.results.begin(request(goal_id=self._id_message))
        if call.reply.done():  # the goal has ended already: nothing is left to wait for
            self._take(call)
        else:
            call.reply.add_done_callback(lambda _: self._take(call))
        return self

    async def _send(self) -> None:
        """Send the goal, and wait until it is accepted."""
        client, limit_s = self._client, TIMEOUT_S
        if self._timeout_s is not None:
            limit_s = min(TIMEOUT_S, self._timeout_s)
            deadline_ns = client.clock.monotonic_ns() + round(self._timeout_s * NS_PER_S)
            self._limit = client.clock.call_at(deadline_ns, self._expire)
        if not client.available and client.endpoints.goals.available:
            # In another process, whose services come one by one.
            await client.ready(timeout=limit_s)
        request: Any = client.types.send_goal.Request
        call = client.endpoints.goals.begin(request(goal_id=self._id_message, goal=self._goal), timeout=limit_s)
        try:
            response = await client.endpoints.goals.answer(call)
        except BaseException as error:
            if isinstance(error, asyncio.CancelledError | ServiceTimeout):  # it may have been accepted meanwhile
                self._post_cancel()
            if isinstance(error, ServiceError):
                raise self._translated(error) from None
            raise
        if not response.accepted:
            why = call.remark or "it gave no reason"
            raise GoalRejected(f"{client.action} rejected the goal {self.id}: {why}")

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if not self._has_ended:
            self._post_cancel()
        self._close(LEFT)

    async def result(self: SentGoal[Parts[Any, R, Any]]) -> R:
        """Wait until the goal has ended, and return its result.

        Raises:
            ActionError: it did not succeed, as `ActionClient.run` says.
            DeadlockError: the server waits, directly or through others, for the caller.
        """
        if not self._has_ended:
            await self._wait(self._waiting)
        if isinstance(self._result, BaseException):
            raise self._result.with_traceback(None)
        return cast("R", self._result)

    async def cancel(self) -> bool:
        """Ask the server to cancel the goal, and return True if it will; `result` then raises `GoalCanceled`.

        Raises:
            ActionError: the server did not answer.
        """
        info = GoalInfo(goal_id=self._id_message)
        try:
            response = await self._client.endpoints.cancels.call(CancelGoal.Request(goal_info=info))
        except ServiceError as error:
            raise self._translated(error) from None
        return response.return_code == CancelGoal.Response.ERROR_NONE

    def __aiter__(self) -> Self:
        return self

    async def __anext__(self: SentGoal[Parts[Any, Any, F]]) -> F:
        while not self._feedback.items:
            if self._has_ended and not self._feedback.is_late:
                raise StopAsyncIteration
            await self._wait(self._feedback.waiting)
        return cast("F", self._feedback.items.popleft())

    def push(self, feedback: Message) -> None:
        """Add feedback; a full queue drops its oldest."""
        self._client.endpoints.goals.feedback_dropped += self._feedback.push(feedback)

    async def _wait(self, waiting: list[asyncio.Future[None]]) -> None:
        """Wait for the goal among the tasks of a list; the running activity waits for it too."""
        if self._asked is None:
            raise NotRunning(f"the goal {self.id} is sent by `async with`, and its result is known in that block")
        self._client.endpoints.results.refuse_cycle(self._asked)
        waiting.append(woken := asyncio.get_running_loop().create_future())
        try:
            await waited(self._asked, woken)
        finally:
            waiting.remove(woken)

    # How it ends.

    def _take(self, call: Call[Any, Any]) -> None:
        """Take the answer to `get_result`."""
        feedback = self._client.endpoints.feedback
        if feedback.items:  # published before the result, and on its way
            feedback.turn(len(feedback.items))
        response: Any = self._client.endpoints.results.end(call)
        if isinstance(response, asyncio.CancelledError):  # the block was left
            return
        if isinstance(response, BaseException):
            self._settle(LOST, self._translated(response) if isinstance(response, ServiceError) else response)
            return
        self._feedback.expect(call.feedback_count)
        if response.status == GoalState.SUCCEEDED:
            self._settle(GoalState.SUCCEEDED, response.result)
            return
        state = GoalState(response.status)
        failure = _failure(state, self._client.action, self.id, call.remark)
        if isinstance(failure, GoalAborted | GoalCanceled):
            failure.result = response.result
        self._settle(state if state.is_terminal else LOST, failure)

    def _expire(self) -> None:
        """Give the goal up, because its time is over."""
        if self._asked is not None and not self._has_ended:
            self._post_cancel()
            text = f"the goal {self.id} of {self._client.action} did not end within {self._timeout_s:g} s"
            self._settle(LEFT, GoalTimeout(f"{text}; it is canceled"))

    def _settle(self, outcome: str | GoalState, result: object) -> None:
        """Set the result, and count the outcome; only the first one counts."""
        if self._has_ended:
            return
        goals = self._client.endpoints.goals
        goals.outcomes[outcome] += 1
        goals.running -= 1
        self._result, self._has_ended = result, True
        wake(self._waiting)
        wake(self._feedback.waiting)

    def _close(self, outcome: str) -> None:
        """Forget the goal; if it has not ended yet, this is its outcome."""
        self._client.sent.pop(self._key, None)
        if self._limit is not None:
            self._limit.cancel()
        if not self._has_ended:
            self._settle(outcome, ActionGone(f"the block of the goal {self.id} was left before it ended"))
        self._feedback.end()
        if self._asked is not None:
            self._asked.reply.cancel()

    def _post_cancel(self) -> None:
        """Ask the server to cancel the goal, without waiting: also a task that is cancelled itself can do so."""
        with suppress(NotRunning):
            cancels = self._client.endpoints.cancels
            call = cancels.begin(CancelGoal.Request(goal_info=GoalInfo(goal_id=self._id_message)))
            call.reply.add_done_callback(lambda _: cancels.end(call))

    def _translated(self, error: BusflowError) -> BusflowError:
        """Return an error of a service as one of the action."""
        action, has_left = self._client.action, self._asked is not None and not self._client.available
        if isinstance(error, ServiceGone) or (has_left and isinstance(error, ServiceUnavailable)):
            return ActionGone(f"{action}: its server ended before the goal {self.id} had")
        if isinstance(error, ServiceTimeout):
            return GoalTimeout(f"{action} did not answer in time whether it takes the goal {self.id}")
        if isinstance(error, ServiceUnavailable):
            is_there = self._client.endpoints.goals.available
            return ActionUnavailable(str(error)) if is_there else self._client.unavailable()
        return ActionError(str(error))

    def __repr__(self) -> str:
        state = "not sent" if not self._is_sent else "ended" if self._has_ended else "sent"
        return f"<SentGoal {self.id} of {self._client.action}: {state}>"


def _is_lost(error: BaseException) -> bool:
    return isinstance(error, BusflowError) and not isinstance(error, GoalTimeout)


def _failure(state: GoalState, action: str, goal_id: UUID, why: str) -> ActionError:
    """Return the error for a goal that has not succeeded."""
    match state:
        case GoalState.ABORTED:
            return GoalAborted(f"{action} aborted the goal {goal_id}: {why or 'the log of its node says why'}")
        case GoalState.CANCELED:
            return GoalCanceled(f"the goal {goal_id} of {action} was canceled")
        case _:
            return ActionGone(f"{action} does not know the goal {goal_id}, or not any more")
