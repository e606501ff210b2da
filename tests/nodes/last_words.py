"""Nodes whose last messages are large."""

import asyncio
import os
import signal

import numpy as np

from busflow import Node, publisher, service
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_srvs import Trigger


class Camera(Node):
    """Publishes five images while it stops."""

    images = publisher(Image, "images")

    async def run(self) -> None:
        size = 1_000_000
        self.last = Image(height=1, width=size, encoding="mono8", step=size, data=np.zeros(size, np.uint8))
        self.log.info("ready")
        await asyncio.Event().wait()

    async def stop(self) -> None:
        for _ in range(5):
            self.images.publish(self.last)


class Library(Node):
    """Ends its run by a call, whose answer is 30 MB."""

    @service(Trigger, "close")
    def close(self, _request: Trigger.Request) -> Trigger.Response:
        os.kill(os.getpid(), signal.SIGINT)
        return Trigger.Response(success=True, message="x" * 30_000_000)
