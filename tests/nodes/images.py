"""Images and numbers of one process, and readers that are slow, stuck or exact."""

import asyncio
import threading

import numpy as np

from busflow import Node, QoS, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Int64

SIZE = 500_000


class Camera(Node):
    """Publishes numbered images, whose bytes all are the number."""

    images = publisher(Image, "images")
    taken = 0

    @timer(0.02)
    def take(self) -> None:
        self.taken += 1
        self.images.publish(Image(height=self.taken, data=np.full(SIZE, self.taken % 256, np.uint8)))


class Viewer(Node):
    """Refuses torn images, and logs each 25th."""

    seen = 0
    last = 0

    @subscription("images")
    def on_image(self, image: Image) -> None:
        if len(image.data) != SIZE or set(image.data[::1000].tolist()) != {image.height % 256}:
            raise ValueError(f"image {image.height} is torn")
        self.seen += 1
        if self.seen % 25 == 0:
            in_order = image.height > self.last or image.height == 1  # the first of a camera that was started again
            self.log.info("seen", count=self.seen, in_order=in_order)
        self.last = image.height


class BusySource(Node):
    """Publishes images of 6 MB at 20 Hz, and 3,000 numbers at 1 kHz."""

    images = publisher(Image, "images")
    numbers = publisher(Int64, "numbers")
    last = 0

    async def start(self) -> None:
        size = 6_000_000
        self.image = Image(width=size, height=1, encoding="mono8", step=size, data=np.zeros(size, np.uint8))

    @timer(hz=20)
    def show(self) -> None:
        self.images.publish(self.image)

    @timer(hz=1000, missed="burst")
    def count(self) -> None:
        if self.last < 3000:
            self.last += 1
            self.numbers.publish(Int64(data=self.last))


class Counter(Node):
    """Logs each number that is missing, and the last one."""

    last = 0

    @subscription("numbers", qos=QoS(depth=4096))
    def on_number(self, number: Int64) -> None:
        if number.data != self.last + 1:
            self.log.error("missing", last=self.last, number=number.data)
        self.last = number.data
        if number.data == 3000:
            self.log.info("counted")


class Stuck(Node):
    """Never returns from its first image."""

    @subscription("images")
    async def on_image(self, _image: Image) -> None:
        self.log.info("is stuck")
        await asyncio.Event().wait()


class Slow(Node):
    """Blocks its process for 0.2 s at each image."""

    @subscription("images")
    def on_image(self, image: Image) -> None:
        self.log.info("is slow", bytes=len(image.data))
        threading.Event().wait(0.2)


class BurstSource(Node):
    """Publishes 50 numbers at a time; its next life publishes higher ones."""

    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.last = self.clock.now_ns() // 1000

    @timer(0.01)
    def publish(self) -> None:
        for _ in range(50):
            self.last += 1
            self.numbers.publish(Int64(data=self.last))


class OrderedReader(Node):
    """Fails when a number does not follow the last one, and logs each 2,000th."""

    received = 0
    last = 0

    @subscription("numbers", qos=QoS(depth=100))
    def on_number(self, number: Int64) -> None:
        if number.data <= self.last:
            raise ValueError(f"{number.data} after {self.last}")
        self.last = number.data
        self.received += 1
        if self.received % 2000 == 0:
            self.log.info("received", count=self.received)
