import asyncio
import time

from busflow import Node, timer


class Fragile(Node):
    lives = 0

    async def start(self) -> None:
        Fragile.lives += 1
        self.blocked = asyncio.Event()

    async def run(self) -> None:
        await self.blocked.wait()

    @timer(0.05)
    def beat(self) -> None:
        if Fragile.lives == 1:
            raise ValueError("not yet")
        if self.beat.fired == 3:
            time.sleep(0.4)
            self.blocked.set()
