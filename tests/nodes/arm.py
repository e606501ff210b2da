"""An arm that takes several goals at once, and a node that floods its clients with feedback."""

import asyncio

from busflow import Node, RunningGoal, action
from tests.actions.conftest import MoveTo


class Arm(Node):
    """Moves by one degree each 10 ms."""

    async def run(self) -> None:
        self.log.info("ready")

    @action(MoveTo, "~/move", when_busy="parallel")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        at = 0
        try:
            while at < goal.request.angle:
                await self.clock.sleep(0.01)
                at += 1
                goal.feedback(MoveTo.Feedback(left=goal.request.angle - at))
        except asyncio.CancelledError:
            self.log.info("stopped", goal=str(goal.id), why=goal.reason)
            return MoveTo.Result(angle=-1)
        return MoveTo.Result(angle=at)


class Flood(Node):
    """Sends as much feedback as the angle says."""

    @action(MoveTo, "~/move")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        for left in range(int(goal.request.angle)):
            goal.feedback(MoveTo.Feedback(left=left))
            if left % 100 == 0:
                await asyncio.sleep(0)
        return MoveTo.Result(angle=goal.request.angle)
