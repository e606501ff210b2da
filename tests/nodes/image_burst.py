"""A node that publishes as many images at once as a message says."""

import numpy as np

from busflow import Node, publisher, subscription
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Int64

IMAGE = Image(height=256, width=256, encoding="mono8", step=256, data=np.zeros(65_536, np.uint8))


class ImageBurst(Node):
    """Publishes images of 64 KiB."""

    images = publisher(Image, "images")

    async def run(self) -> None:
        self.log.info("ready")

    @subscription("go")
    def on_go(self, count: Int64) -> None:
        for _ in range(count.data):
            self.images.publish(IMAGE)
