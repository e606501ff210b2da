"""A node that counts up: at its start, by a timer, and until it fails."""

from busflow import Node, Parameters, publisher, service, timer
from busflow.msgs.std_msgs import Int64
from busflow.msgs.std_srvs import Trigger


class SourceParameters(Parameters):
    """How the node counts; 0 turns each off."""

    at_start: int = 0
    rate_hz: float = 0.0
    fail_at: int = 0


class Source(Node):
    """Publishes 1, 2, 3, …, and answers how many it has published."""

    parameters: SourceParameters
    numbers = publisher(Int64, "numbers")
    last = 0

    async def start(self) -> None:
        self.log.info("draws", number=int(self.rng.integers(1 << 30)))

    async def run(self) -> None:
        for _ in range(self.parameters.at_start):
            self.publish_next()

    @timer(hz="rate_hz")
    def publish_next(self) -> None:
        self.last += 1
        if self.last == self.parameters.fail_at:
            raise ValueError("lost count")
        self.numbers.publish(Int64(data=self.last))

    @service(Trigger, "count")
    def count(self, _request: Trigger.Request) -> Trigger.Response:
        return Trigger.Response(success=True, message=str(self.last))
