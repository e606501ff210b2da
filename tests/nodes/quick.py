"""Nodes beside programs."""

import os
import select
from pathlib import Path

from busflow import Node


class Quick(Node):
    """Logs its start and its end."""

    async def start(self) -> None:
        self.log.info("node starts")

    async def stop(self) -> None:
        self.log.info("node stops")


class FailsToStart(Node):
    """Has no camera."""

    async def start(self) -> None:
        raise RuntimeError("no camera")


class Watcher(Node):
    """Logs at its end whether the program of `driver.pid` is still there."""

    async def stop(self) -> None:
        self.log.info(await self.run_sync(self.look))

    def look(self) -> str:
        program = os.pidfd_open(int(Path("driver.pid").read_text()))
        ended, _, _ = select.select([program], [], [], 0.3)
        os.close(program)
        return "the driver has gone" if ended else "the driver is still there"
