"""A camera that sees a bright disc go round."""

import numpy as np
from pydantic import Field

from busflow import SENSOR_DATA, Node, Parameters, ReadOnly, publisher, take, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Header


class CameraParameters(Parameters):
    rate_hz: float = Field(default=30.0, gt=0, description="Frames a second.")
    width: ReadOnly[int] = Field(default=160, ge=16, description="Pixels in a row.")
    height: ReadOnly[int] = Field(default=120, ge=16, description="Rows.")


class Camera(Node):
    """Publishes grey images with a disc that goes round once in four seconds."""

    parameters: CameraParameters
    images = publisher(Image, "camera/image_raw", qos=SENSOR_DATA)

    async def start(self) -> None:
        self.rows, self.columns = np.mgrid[: self.parameters.height, : self.parameters.width]

    @timer(hz="rate_hz")
    def expose(self) -> None:
        height, width = self.parameters.height, self.parameters.width
        angle = self.clock.seconds() * np.pi / 2
        x, y = width / 2 + width / 4 * np.cos(angle), height / 2 + height / 4 * np.sin(angle)
        disc = (self.columns - x) ** 2 + (self.rows - y) ** 2 < (height / 12) ** 2
        frame = np.where(disc, 250, 20).astype(np.uint8)
        self.images.publish(
            Image(
                header=Header(stamp=self.clock.now(), frame_id="camera"),
                height=height,
                width=width,
                encoding="mono8",
                step=width,
                data=take(frame.ravel()),  # the array is not changed again, so the message need not copy it
            )
        )
