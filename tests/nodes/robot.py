"""A script that runs `run.yaml` with a node of its own; its argument holds more of `busflow.run`, as JSON."""

import json
import sys

import busflow
from busflow import Node, subscription
from busflow.msgs.std_msgs import Int64


class Beside(Node):
    """Logs that it has received the twentieth number or, where its queue was full, a later one."""

    enough = False

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        if number.data >= 20 and not self.enough:
            self.enough = True
            self.log.info("beside received 20")


if __name__ == "__main__":
    sys.exit(busflow.run("run.yaml", Beside, **json.loads(sys.argv[1])))
