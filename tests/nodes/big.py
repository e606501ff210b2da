"""A node with images that are too large for another process, and one that waits for them."""

import numpy as np

from busflow import Node, publisher, subscription
from busflow.msgs.sensor_msgs import Image


class Big(Node):
    """Publishes twice."""

    images = publisher(Image, "image")

    async def run(self) -> None:
        while not self.images.is_received:
            await self.clock.sleep(0.1)
        image = Image(data=np.zeros(300_000_000, dtype=np.uint8))
        self.images.publish(image)
        self.images.publish(image)
        self.log.info("published")


class Watcher(Node):
    """Receives nothing."""

    @subscription("image")
    def on_image(self, image: Image) -> None: ...
