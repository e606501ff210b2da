"""A program whose node uses a pool of processes; its arguments are how these start, and whether all are busy then."""

import asyncio
import multiprocessing
import sys

import busflow
from busflow import Node


def work(number: int) -> int:
    return number * 2


class Forks(Node):
    """Waits once the pool has worked, or keeps one of its processes and itself busy for ever."""

    async def run(self) -> None:
        with multiprocessing.get_context(sys.argv[1]).Pool(2) as pool:
            found = await self.run_sync(pool.map, work, range(3))
            self.log.info("ready", found=str(found))
            if sys.argv[2] == "busy":
                pool.apply_async(any, (iter(int, 1),))
                any(() for _ in iter(int, 1))
            await asyncio.Event().wait()


if __name__ == "__main__":
    sys.exit(busflow.run(Forks, inspect="forks"))
