from busflow import Node, RunningGoal, action
from busflow.msgs.example_interfaces import Fibonacci


class Counter(Node):
    """Counts to the order of a goal; to 0 it counts for ever."""

    async def start(self) -> None:
        self.log.info("it counts")

    @action(Fibonacci, "~/count", when_busy="parallel", at_most=20)
    async def count(self, goal: RunningGoal[Fibonacci]) -> Fibonacci.Result:
        numbers = [1]
        while len(numbers) != goal.request.order:
            goal.feedback(Fibonacci.Feedback(sequence=numbers[-9:]))
            await self.clock.sleep(0.02)
            numbers.append(len(numbers) + 1)
        return Fibonacci.Result(sequence=numbers)

    @count.accepts
    def possible(self, request: Fibonacci.Goal) -> bool | str:
        return True if request.order >= 0 else f"it does not count to {request.order}"
