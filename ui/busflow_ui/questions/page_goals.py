"""PageGoals: the goals that one page sends to actions; a page that goes has its goals canceled.

A goal goes on for as long as it takes. So each has a thread that waits for its end, and no question waits for it.
"""

from __future__ import annotations

import asyncio
import uuid
from base64 import b64encode
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import TYPE_CHECKING, Any

from busflow.commands import ActionPeer, action_named
from busflow.errors import ActionUnavailable, GoalCanceled, GoalTimeout, MalformedMessage
from busflow.text import printable
from busflow_ui import timeouts
from busflow_ui.foxglove.catalogue import written_form
from busflow_ui.questions import arguments as checked

if TYPE_CHECKING:
    from busflow.commands import PeerGoal
    from busflow_ui.foxglove.bridge import Bridge

_MOST_GOALS = 8
"""Most goals of one page that have not ended: half of what it may ask at once, so that a cancel always has room."""
_MOST_LIMIT_S = 86_400.0

SendPart = Callable[[object], None]


class PageGoals:
    """Goals of one page."""

    def __init__(self, bridge: Bridge) -> None:
        self._bridge = bridge
        self._threads = ThreadPoolExecutor(_MOST_GOALS, "busflow-ui-goal")
        self._goals: set[_SentGoal] = set()

    async def types(self, arguments: Mapping[str, Any]) -> object:
        """Return what a goal and a result of an action are: `{type, goal, result}`."""
        client = await self._bridge.call(self._client, checked.text(arguments, "action"))
        goal, result = written_form(client.goal_type), written_form(client.result_type)
        return {"type": client.action.type, "goal": goal, "result": result}

    async def send(self, arguments: Mapping[str, Any], send_part: SendPart) -> object:
        """Send a goal, and wait for its end: `{state, result, reason}`; `{id}` comes when it is accepted."""
        name, payload = checked.text(arguments, "action"), checked.encoded(arguments, "goal")
        limit_s = None
        if arguments.get("limit_s") is not None:
            limit_s = checked.number(arguments, "limit_s", above=0, most=_MOST_LIMIT_S, default=1)
        if len(self._goals) >= _MOST_GOALS:
            raise ActionUnavailable(f"{_MOST_GOALS} goals of this page have not ended; cancel one, or wait")
        loop = asyncio.get_running_loop()
        goal = _SentGoal(
            partial(self._client, name), payload, lambda id_: loop.call_soon_threadsafe(send_part, {"id": id_})
        )
        self._goals.add(goal)
        limit = asyncio.timeout(limit_s)
        try:
            async with limit:
                return await loop.run_in_executor(self._threads, goal.run)
        except TimeoutError:
            if not limit.expired():
                raise
            raise GoalTimeout(f"the goal did not end within {limit_s:g} s; it is canceled") from None
        finally:
            goal.give_up()
            self._goals.discard(goal)

    async def cancel(self, arguments: Mapping[str, Any]) -> object:
        """Cancel a goal of an action, of this page or of others; all of them where none is named: `{canceling}`."""
        name = checked.text(arguments, "action")
        goal_id = None if arguments.get("id") is None else _identifier(checked.text(arguments, "id"))
        canceling = await self._bridge.call(lambda: self._client(name).cancel(goal_id, timeout_s=timeouts.current.goal))
        return {"canceling": canceling}

    def close(self) -> None:
        """Cancel the goals that have not ended."""
        for goal in self._goals:
            goal.give_up()
        self._threads.shutdown(wait=False)

    def _client(self, action: str) -> ActionPeer:
        return ActionPeer(self._bridge.peer, action_named(self._bridge.graph, action))


class _SentGoal:
    """Goal that a thread sends, and whose end it waits for."""

    def __init__(
        self, make_client: Callable[[], ActionPeer], payload: bytes, on_accepted: Callable[[str], object]
    ) -> None:
        self._make_client, self._payload, self._on_accepted = make_client, payload, on_accepted
        self._going: PeerGoal | None = None
        self._is_given_up = False

    def run(self) -> dict[str, Any]:
        """Send it, and wait for its end; blocks until then."""
        client = self._make_client()
        values = client.goal_type.decode(self._payload)
        with client.sent(values, timeout_s=timeouts.current.goal) as going:
            self._going = going
            self._on_accepted(str(going.id))
            if self._is_given_up:  # while it was sent
                going.give_up()
            try:
                state, result = going.result()
            except GoalCanceled:
                # A server of ROS 2 would not notice that its client has gone.
                going.cancel(timeout_s=timeouts.current.goal)
                raise
            payload = client.result_type.encode(result)
            return {"state": state, "result": b64encode(payload).decode(), "reason": going.remark}

    def give_up(self) -> None:
        """Wait no longer, and cancel the goal if it has not ended; from any thread."""
        self._is_given_up = True
        if self._going is not None:
            self._going.give_up()


def _identifier(text: str) -> uuid.UUID:
    try:
        return uuid.UUID(text)
    except ValueError:
        raise MalformedMessage(f"{printable(text, limit=100)!r} is not the identifier of a goal") from None
