"""A node whose timer never returns, though it calls functions."""

from busflow import Node, timer


class Stuck(Node):
    """Logs for ever, below the level that is shown."""

    @timer(0.1)
    def work(self) -> None:
        while True:
            self.log.debug("on")
