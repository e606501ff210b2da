"""Nodes that block the event loop in each kind of handler, and one that has to stop all the same."""

import asyncio
import time

from busflow import Node, QoS, publisher, subscription, timer
from busflow.msgs.std_msgs import Int64


class Source(Node):
    """Publishes 20 numbers at a time."""

    numbers = publisher(Int64, "numbers")

    @timer(0.05)
    def tick(self) -> None:
        for number in range(20):
            self.numbers.publish(Int64(data=number))


class Motor(Node):
    """Logs that it has stopped."""

    async def stop(self) -> None:
        await self.clock.sleep(0.01)
        self.log.info("the motor is off")


class SlowTimer(Node):
    """Blocks in a timer."""

    @timer(0.05)
    def tick(self) -> None:
        time.sleep(1.0)


class SlowHandler(Node):
    """Blocks at each message."""

    @subscription("numbers", qos=QoS(depth=100))
    def on_number(self, _number: Int64) -> None:
        time.sleep(0.3)


class SlowTask(Node):
    """Blocks in the task of each message."""

    @subscription("numbers", qos=QoS(depth=100))
    async def on_number(self, _number: Int64) -> None:
        time.sleep(0.3)


class SlowRun(Node):
    """Blocks in its `run`."""

    async def run(self) -> None:
        while True:
            time.sleep(1.0)
            await asyncio.sleep(0)
