"""A simulated camera."""

import numpy as np
from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, ReadOnly, publisher, take, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Header

from .sensor_publisher import gradient


class CameraParameters(Parameters):
    rate_hz: float = Field(default=10.0, ge=0, le=200, description="How often a frame is published; 0 is off.")
    width: ReadOnly[int] = Field(default=320, ge=1, le=7680, description="Width of a frame, pixels.")
    height: ReadOnly[int] = Field(default=240, ge=1, le=4320, description="Height of a frame, pixels.")
    frame_id: ReadOnly[str] = Field(default="camera_link", description="The camera's frame.")


class Camera(Node):
    """Publishes frames: a gradient, with a bright bar that moves once across it per second."""

    parameters: CameraParameters

    images = publisher(Image, "camera/image_raw", qos=SENSOR_DATA)

    async def start(self) -> None:
        self.scene = gradient(self.parameters.width, self.parameters.height)

    @timer(hz="rate_hz")
    def publish_image(self) -> None:
        width, height = self.parameters.width, self.parameters.height
        frame = self.scene.copy()
        frame[:, int(self.clock.seconds() * width) % width] = 255
        self.images.publish(
            Image(
                header=Header(stamp=self.clock.now(), frame_id=self.parameters.frame_id),
                height=height,
                width=width,
                encoding="rgb8",
                step=3 * width,
                data=take(np.ravel(frame)),  # this frame is not changed again, so the message need not copy it
            )
        )
