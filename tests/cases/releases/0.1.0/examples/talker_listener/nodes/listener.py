"""Logs what it receives."""

from busflow import Node, subscription
from busflow.msgs.std_msgs import String


class Listener(Node):
    """Logs each greeting."""

    @subscription("chatter")
    def on_chatter(self, message: String) -> None:
        self.log.info("received", text=message.data)
