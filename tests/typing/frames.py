# pyright: strict, reportUnnecessaryTypeIgnoreComment=true
"""What a strict type checker sees of frames and of messages that wait: read, never run; each ignore must be needed."""

from typing import assert_type

from busflow import Node, Time, Unpaired, on_event, subscription, synchronized, transforms
from busflow.msgs.geometry_msgs import PointStamped, TransformStamped
from busflow.msgs.sensor_msgs import Image, PointCloud2


class Robot(Node):
    frames = transforms()

    @synchronized("left/image", "right/image", within="20ms")
    def on_pair(self, left: Image, right: Image) -> None:
        assert_type((left, right), tuple[Image, Image])
        assert_type(self.frames.latest("map", "base_link"), TransformStamped)

    @subscription("points", in_frame="map", wait=0.1)
    async def on_points(self, cloud: PointCloud2) -> None:
        assert_type(self.frames.apply(cloud, "map"), PointCloud2)
        assert_type(await self.frames.lookup("map", "base_link", at=cloud.header.stamp), TransformStamped)
        await self.frames.lookup("map", "base_link", at=Time(1), timeout=0.2)
        await self.frames.lookup("map", "base_link", at=1.5)  # type: ignore[arg-type]  # a time, not seconds
        self.frames.apply(TransformStamped(), "map")  # type: ignore[type-var]  # it cannot be moved
        self.frames.send(TransformStamped())
        self.frames.send(PointStamped())  # type: ignore[arg-type]  # not a transform

    @on_event("left/image")
    def on_alone(self, event: Unpaired) -> None:
        assert_type(event.nearest_s, float | None)

    def ask(self) -> None:
        self.on_pair(Image(), Image())
        self.on_pair(Image())  # type: ignore[call-arg]  # one of each
