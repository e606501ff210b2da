# pyright: strict, reportUnnecessaryTypeIgnoreComment=true
"""What a strict type checker sees of actions: read, never run; each ignore must be needed."""

from typing import assert_type

from busflow import ActionType, Message, Node, RunningGoal, action, action_client
from busflow.testing import harness


class MoveTo(ActionType, package="test"):
    class Goal(Message):
        angle: float = 0.0

    class Result(Message):
        reached: float = 0.0

    class Feedback(Message):
        left: float = 0.0


class Arm(Node):
    other = action_client(MoveTo, "other/move")

    @action(MoveTo, "~/move", when_busy="queue", at_most=3)
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        assert_type(goal.request, MoveTo.Goal)
        goal.feedback(MoveTo.Feedback(left=1))
        goal.feedback(MoveTo.Goal())  # type: ignore[arg-type]  # feedback is another message
        return await self.other.run(goal.request)

    @move.accepts
    def reachable(self, request: MoveTo.Goal) -> bool | str:
        return request.angle > 0 or "it is behind"

    @action(MoveTo, "~/wrong")  # type: ignore[arg-type]  # the result is another message
    async def wrong(self, goal: RunningGoal[MoveTo]) -> MoveTo.Goal:
        return goal.request


async def sent(arm: Arm) -> None:
    assert_type(await arm.other.run(MoveTo.Goal(angle=1), timeout=3), MoveTo.Result)
    await arm.other.run(MoveTo.Result())  # type: ignore[arg-type]  # a goal is another message
    async with arm.other.send(MoveTo.Goal()) as going:
        async for feedback in going:
            assert_type(feedback, MoveTo.Feedback)
        assert_type(await going.result(), MoveTo.Result)
    for goal in arm.move.goals:
        assert_type(goal.request, MoveTo.Goal)
    async with harness(Arm) as lab:
        assert_type(lab.node(Arm).move.action, str)
