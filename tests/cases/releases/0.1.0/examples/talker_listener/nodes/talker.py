"""Publishes a counted greeting."""

from pydantic import Field

from busflow import Node, Parameters, publisher, timer
from busflow.msgs.std_msgs import String


class TalkerParameters(Parameters):
    rate_hz: float = Field(default=1.0, gt=0, description="How often to speak, Hz.")


class Talker(Node):
    """Says hello, and counts."""

    parameters: TalkerParameters
    chatter = publisher(String, "chatter")

    async def start(self) -> None:
        self.count = 0

    @timer(hz="rate_hz")
    def speak(self) -> None:
        self.count += 1
        self.chatter.publish(String(data=f"hello {self.count}"))
