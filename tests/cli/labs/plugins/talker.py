from busflow import Node, Parameters, publisher, timer
from busflow.msgs.std_msgs import Float64


class TalkerParameters(Parameters):
    rate_hz: float = 100.0
    fail_at: int = 0


class Talker(Node):
    """Counts aloud."""

    parameters: TalkerParameters
    numbers = publisher(Float64, "numbers")
    count = 0

    @timer(hz="rate_hz")
    def talk(self) -> None:
        self.count += 1
        if 0 < self.parameters.fail_at <= self.count:
            raise ValueError("\x1b[31mlost count")
        self.numbers.publish(Float64(data=float(self.count)))
