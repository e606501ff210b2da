"""Nodes whose processes end with their nodes, or leave another process behind."""

import os
import signal
import subprocess
import sys
from pathlib import Path

from busflow import Node, timer

WAITING = "import signal; signal.pause()"


class Ending(Node):
    """Returns at once, and its process with it; it notes the process."""

    async def run(self) -> None:
        with Path("lives").open("a") as lives:
            lives.write(f"{os.getpid()}\n")


class Watching(Node):
    """Logs when the last of `LIVES` processes has ended."""

    @timer(hz=20)
    def look(self) -> None:
        pids = Path("lives").read_text().split()
        if len(pids) >= int(os.environ["LIVES"]):
            try:
                os.kill(int(pids[-1]), 0)
            except ProcessLookupError:
                self.log.info("settled")


class Leaving(Node):
    """Starts a program, or forks into a session of its own."""

    async def start(self) -> None:
        if os.environ["LEAVES"] == "program":
            pid = subprocess.Popen([sys.executable, "-c", WAITING]).pid
        elif (pid := os.fork()) == 0:
            os.setsid()
            signal.pause()
            os._exit(0)
        self.log.info("left behind", left=pid)
