"""A node whose process ends in another way in each of its lives, at the stages that `STAGES` names."""

import os
import signal
from pathlib import Path

from busflow import Node, timer

WAYS = [lambda: os._exit(0), lambda: os._exit(3)]
WAYS += [lambda n=n: signal.raise_signal(n) for n in (signal.SIGTERM, signal.SIGKILL, signal.SIGSEGV)]
LIVES = Path("lives")
STAGES = os.environ.get("STAGES", "").split()[LIVES.stat().st_size :]  # in which this life and later ones end
ENDED: list[str] = []  # one that got SIGTERM may come here once more before it has stopped


def die(stage: str) -> None:
    """End this process if this is its stage."""
    if STAGES[:1] == [stage] and not ENDED:
        ENDED.append(stage)
        with LIVES.open("a") as lives:
            lives.write(".")
        WAYS[(LIVES.stat().st_size - 1) % len(WAYS)]()


die("import")


class Dying(Node):
    """Ends its process, or logs that all lives are over."""

    async def start(self) -> None:
        die("start")

    @timer(hz=20)
    def work(self) -> None:
        die("run")
        if not STAGES:
            self.log.info("settled")
