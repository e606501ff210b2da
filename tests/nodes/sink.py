"""A node that logs when it has received enough numbers, and when they begin anew."""

from busflow import Node, Parameters, subscription
from busflow.msgs.std_msgs import Int64


class SinkParameters(Parameters):
    """How many numbers are enough."""

    enough: int = 1


class Sink(Node):
    """Counts the numbers that it receives."""

    parameters: SinkParameters
    received = 0
    last = 0

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        self.received += 1
        if number.data < self.last:
            self.log.info("begins anew", last=self.last)
        self.last = number.data
        if self.received == self.parameters.enough:
            self.log.info("received enough", received=self.received, last=self.last)
