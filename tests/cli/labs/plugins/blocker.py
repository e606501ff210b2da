import time

from busflow import Node


class Blocker(Node):
    """Blocks the loop."""

    async def run(self) -> None:
        self.log.warning("blocks")
        time.sleep(30)  # noqa: ASYNC251  # it blocks the loop on purpose
