"""A flood of numbers and images, and a node that notes what it misses of them."""

import numpy as np

from busflow import Node, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Float64MultiArray, Int64

NUMBERS = Float64MultiArray(data=[0.5] * 40)
IMAGE = Image(height=1080, width=1920, encoding="rgb8", step=5760, data=np.zeros(6_220_800, np.uint8))


class Flood(Node):
    """Publishes at 1 kHz, and images of 6 MB at 20 Hz."""

    numbers = publisher(Float64MultiArray, "numbers")
    images = publisher(Image, "images")
    counts = publisher(Int64, "counts")
    ticks = 0

    async def run(self) -> None:
        self.log.info("ready")

    @timer(0.001, missed="burst")
    def tick(self) -> None:
        self.ticks += 1
        self.numbers.publish(NUMBERS)
        if self.ticks % 50 == 0:
            self.images.publish(IMAGE)
        self.counts.publish(Int64(data=self.ticks))


class Reader(Node):
    """Logs at its end how many counts it has missed."""

    last = missed = 0

    @subscription("counts")
    def on_count(self, count: Int64) -> None:
        self.missed += count.data - self.last - 1
        self.last = count.data

    async def stop(self) -> None:
        self.log.info("received", missed=self.missed)
