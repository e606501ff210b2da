"""A node that is ready, and waits."""

import asyncio

from busflow import Node


class Waiting(Node):
    """Logs that it is ready."""

    async def run(self) -> None:
        self.log.info("ready")
        await asyncio.Event().wait()
