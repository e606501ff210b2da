"""A node that logs each number, and blocks its process if a parameter says so."""

import threading

from busflow import Node, Parameters, subscription, timer
from busflow.msgs.std_msgs import Int64


class ListenerParameters(Parameters):
    """How long it blocks."""

    busy_s: float = 0.0


class Listener(Node):
    """Logs that it listens, and each number."""

    parameters: ListenerParameters

    async def start(self) -> None:
        self.log.info("listens")

    @timer(0.01)
    def block(self) -> None:
        threading.Event().wait(self.parameters.busy_s)

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        self.log.info("received", number=number.data)
