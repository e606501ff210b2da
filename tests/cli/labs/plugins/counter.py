from busflow import Node, RunningGoal, action, action_client
from busflow.msgs.example_interfaces import Fibonacci


class Arm(Node):
    count = action_client(Fibonacci, "~/count")

    @action(Fibonacci, "~/count", when_busy="parallel")
    async def on_count(self, goal: RunningGoal[Fibonacci]) -> Fibonacci.Result:
        while goal.request.order:
            await self.clock.sleep(3600)
        return Fibonacci.Result()

    async def run(self) -> None:
        await self.count.run(Fibonacci.Goal())
        self.log.info("works")
        await self.count.run(Fibonacci.Goal(order=1))
