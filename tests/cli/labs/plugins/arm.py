from busflow import ActionType, Message, Node, RunningGoal, action, action_client
from busflow.msgs.example_interfaces import Fibonacci


class MoveTo(ActionType, package="my_robot"):
    class Goal(Message):
        angle: float = 0.0
        name: str = ""

    class Result(Message):
        angle: float = 0.0

    class Feedback(Message):
        left: float = 0.0


class Counting(Node):
    """The server of ROS 2's tutorials."""

    @action(Fibonacci, "/fibonacci")
    async def count(self, goal: RunningGoal[Fibonacci]) -> Fibonacci.Result:
        found = [0, 1]
        for _ in range(goal.request.order - 1):
            found.append(found[-1] + found[-2])
            goal.feedback(Fibonacci.Feedback(sequence=found))
        return Fibonacci.Result(sequence=found)


class Arm(Node):
    missing = action_client(MoveTo, "nobody/move")

    async def run(self) -> None:
        self.log.info("works")

    @action(MoveTo, "~/move", when_busy="parallel")
    async def move(self, goal: RunningGoal[MoveTo]) -> MoveTo.Result:
        if goal.request.angle < 0:
            raise ValueError("no way \x1b[31mback")
        left = goal.request.angle
        while left > 0:
            await self.clock.sleep(0.01)
            left -= 1
            goal.feedback(MoveTo.Feedback(left=left))
        return MoveTo.Result(angle=goal.request.angle)

    @move.accepts
    def reachable(self, request: MoveTo.Goal) -> bool | str:
        return request.angle < 1e6 or "out of reach"
