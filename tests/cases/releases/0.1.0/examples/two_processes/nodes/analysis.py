"""A computation that takes long."""

import numpy as np

from busflow import Node, QoS, publisher, subscription
from busflow.msgs.std_msgs import Float64


class Analysis(Node):
    """Publishes the strongest frequency of the last second, once a second."""

    strongest = publisher(Float64, "strongest_hz")

    async def start(self) -> None:
        self.window: list[float] = []

    @subscription("value", qos=QoS(depth=200))  # what comes while it computes waits
    def on_value(self, value: Float64) -> None:
        self.window.append(value.data)
        if len(self.window) == 100:
            spectrum = np.abs(np.fft.rfft(np.repeat(self.window, 500)))
            self.window.clear()
            self.strongest.publish(Float64(data=float(spectrum[1:51].argmax() + 1)))
