"""The robot of a run with which nodes of ROS 2 exchange messages."""

import asyncio
from typing import Any

from busflow import Durability, Node, Parameters, QoS, publisher, subscription
from busflow.msgs.std_msgs import Int64, String

KEPT = QoS(depth=5, durability=Durability.TRANSIENT_LOCAL)


class Robot(Node):
    class Parameters(Parameters):
        gain: float = 0.5

    parameters: Parameters
    map = publisher(Int64, "map", qos=KEPT)

    async def start(self) -> None:
        self.arrived: asyncio.Queue[Any] = asyncio.Queue()

    @subscription("/plan", qos=KEPT)
    async def on_plan(self, plan: Int64) -> None:
        await self.arrived.put(plan.data)

    @subscription("/words")
    async def on_words(self, words: String) -> None:
        await self.arrived.put(words.data)
