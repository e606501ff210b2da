from busflow import Node, publisher
from busflow.msgs.std_msgs import Float64


class Speaker(Node):
    numbers = publisher(Float64, "numbers")

    async def start(self) -> None:
        self.numbers.publish(Float64(data=1.0))
