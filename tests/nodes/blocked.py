"""A node that blocks its event loop for an hour."""

import time

from busflow import Node, timer


class Blocks(Node):
    """Logs that it is ready, and never returns."""

    @timer(0.05)
    def tick(self) -> None:
        self.log.info("ready")
        time.sleep(3600)
