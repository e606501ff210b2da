"""An arm that moves to an angle, one degree a second, and the node that sends it there."""

import asyncio

from busflow import ActionType, Message, Node, RunningGoal, action, action_client


class MoveTo(ActionType, package="my_robot"):
    """Moves a joint."""

    class Goal(Message):
        """Where to."""

        angle: float = 0.0

    class Result(Message):
        """Where it is."""

        angle: float = 0.0

    class Feedback(Message):
        """How far it is."""

        left: float = 0.0


class Arm(Node):
    """Moves one degree a second, and says where it stopped."""

    at = 0.0

    @action(MoveTo, "~/move")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        try:
            await self.travel(goal)
        except asyncio.CancelledError:
            return MoveTo.Result(angle=self.at)
        return MoveTo.Result(angle=self.at)

    async def travel(self, goal: RunningGoal[MoveTo]) -> None:
        if goal.request.angle < 0:
            raise ValueError("no way back")
        self.at = 0.0
        while self.at < goal.request.angle:
            await self.clock.sleep(1)
            self.at += 1
            goal.feedback(MoveTo.Feedback(left=goal.request.angle - self.at))

    @move.accepts
    def reachable(self, request: MoveTo.Goal) -> bool | str:
        return True if request.angle <= 180 else f"the joint ends at 180, not {request.angle:g}"


class Boss(Node):
    """Sends goals."""

    move = action_client(MoveTo, "arm/move")


def balanced(lab):
    """True if the accounts of the arm's goals are, on both sides."""
    (service,) = [each for each in lab.graph.bus.statistics().services if each.service.endswith("/send_goal")]
    servers = all(
        each.received == each.rejected + each.succeeded + each.aborted + each.canceled + each.running + each.queued
        for each in service.servers
    )
    clients = all(
        each.called
        == each.rejected + each.succeeded + each.aborted + each.canceled + each.left + each.lost + each.running
        for each in service.clients
    )
    return servers and clients
