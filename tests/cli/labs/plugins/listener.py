from busflow import Node, subscription
from busflow.msgs.std_msgs import Float64


class Listener(Node):
    """Logs what it receives."""

    @subscription("numbers")
    def receive(self, number: Float64) -> None:
        self.log.info("heard", number=number.data)
