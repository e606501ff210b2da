"""Nodes that fail, hang or print, each in one way."""

import asyncio
import sys
import threading
import time

from busflow import Node, timer


class Printer(Node):
    """Prints to both streams, with a control sequence, and without a line end."""

    async def start(self) -> None:
        print("hello \x1b[31mred")
        print("to the left", file=sys.stderr)
        sys.stdout.write("no end")


class FailsToStop(Node):
    """Raises while it stops."""

    async def stop(self) -> None:
        raise ValueError("the cable is loose")


class FailsInTask(Node):
    """Holds a task that fails."""

    async def start(self) -> None:
        self.task = asyncio.create_task(self.work())

    async def work(self) -> None:
        raise ValueError("the wheel is loose")


class HangsAtStop(Node):
    """Blocks its process for ever while it stops."""

    async def stop(self) -> None:
        threading.Event().wait()


class Hanging(Node):
    """Starts for longer than it may hang, and then keeps the interpreter busy for ever."""

    async def start(self) -> None:
        time.sleep(1.5)

    @timer(0.3)
    def hang(self) -> None:
        while True:
            pass


class Busy(Node):
    """Blocks its process for 0.1 s, again and again."""

    @timer(0.01)
    def block(self) -> None:
        threading.Event().wait(0.1)
