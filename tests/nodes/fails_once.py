"""A node that fails in its first life only."""

from pathlib import Path

from busflow import Node, publisher
from busflow.msgs.std_msgs import Int64


class FailsOnce(Node):
    """Publishes a number once it has been restarted; `marks` remembers its first life."""

    numbers = publisher(Int64, "numbers")

    async def run(self) -> None:
        marker = Path("marks", self.name)
        if not marker.exists():
            marker.touch()
            raise RuntimeError("fails once, and is restarted")
        self.numbers.publish(Int64(data=1))
