"""A fast sensor."""

from busflow import Node, publisher, timer
from busflow.msgs.std_msgs import Float64


class Sensor(Node):
    """Publishes a random value a hundred times a second."""

    values = publisher(Float64, "value")

    @timer(hz=100)
    def sample(self) -> None:
        self.values.publish(Float64(data=float(self.rng.normal())))
