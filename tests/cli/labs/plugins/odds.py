import asyncio

import numpy as np

from busflow import Message, Node, QoS, publisher, subscription, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Float64, Int64, String


class Note(Message, package="odd"):
    """Message with values that no definition file of ROS 2 can state."""

    text: str
    place: str | None = None
    marks: dict[str, float] = {}  # noqa: RUF012  # a message copies it


class Odds(Node):
    """Topics as they are not in the lab: large, latched, kept, foreign to ROS, flooded, without a subscription."""

    image = publisher(Image, "camera/image")
    talk = publisher(String, "talk")
    note = publisher(Note, "note")
    name_of_map = publisher(String, "map_name", qos=QoS(durability="transient_local"))
    numbers = publisher(Int64, "numbers")
    flood = publisher(Int64, "flood")
    commanded = publisher(Float64, "commanded")
    unused = publisher(Int64, "_hidden/count")
    count = 0

    async def start(self) -> None:
        self.pixels = np.zeros(1920 * 1080 * 3, np.uint8)
        self.name_of_map.publish(String(data="attic"))
        self.log.info("ready")

    @timer(0.2)
    def show(self) -> None:
        self.image.publish(Image(height=1080, width=1920, encoding="rgb8", step=5760, data=self.pixels))
        self.talk.publish(String(data="\x1b[31mred\u202e"))
        self.note.publish(Note(text="a, b", marks={"x": float("inf")}))

    @timer(0.01)
    def tick(self) -> None:
        self.count += 1
        self.numbers.publish(Int64(data=self.count))
        self.flood.publish(Int64(data=self.count))

    @subscription("flood", qos=QoS(depth=1))
    async def on_flood(self, _number: Int64) -> None:
        await asyncio.sleep(0.05)

    @subscription("cmd")
    def on_command(self, command: Float64) -> None:
        self.commanded.publish(command)

    @subscription("strict", qos=QoS(deadline=900, lease=800, liveliness="manual_by_topic"))
    def on_strict(self, command: Float64) -> None:
        self.commanded.publish(command)
