"""Nodes that log where they run: their process, their environment, their event loop, their time."""

import asyncio
import os

from busflow import Node, timer


class Place(Node):
    """Logs its process and what the environment says."""

    async def start(self) -> None:
        loop = type(asyncio.get_running_loop()).__base__
        self.log.info("place", pid=os.getpid(), robot=os.environ.get("ROBOT", ""), loop=loop.__module__)


class Ticker(Node):
    """Logs the second of each tick."""

    async def start(self) -> None:
        self.log.info("ready")

    @timer(1)
    def tick(self) -> None:
        self.log.info("tick", second=self.clock.now().sec)
