"""Finds the bright disc."""

import numpy as np
from pydantic import Field

from busflow import Node, Parameters, QoS, Reliability, publisher, subscription
from busflow.msgs.geometry_msgs import Point, PointStamped
from busflow.msgs.sensor_msgs import Image


class TrackerParameters(Parameters):
    threshold: int = Field(default=128, ge=1, le=255, description="The least brightness of what is tracked.")


class Tracker(Node):
    """Publishes the centre of the bright pixels of the newest image."""

    parameters: TrackerParameters
    positions = publisher(PointStamped, "disc")

    @subscription(
        "camera/image_raw", qos=QoS(depth=1, reliability=Reliability.BEST_EFFORT)
    )  # an old image is of no use
    def on_image(self, image: Image) -> None:
        pixels = np.asarray(image.data).reshape(image.height, image.step)
        rows, columns = np.nonzero(pixels >= self.parameters.threshold)
        if rows.size:
            centre = Point(x=float(columns.mean()), y=float(rows.mean()))
            self.positions.publish(PointStamped(header=image.header, point=centre))
