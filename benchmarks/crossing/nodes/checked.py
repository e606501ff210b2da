"""A pusher of numbered blobs with their checksums, and a checker that refuses what is torn, twice, or out of order."""

import random
import zlib
from typing import Any

import numpy as np

from busflow import Node, Parameters, PublisherMatched, QoS, SubscriptionMatched, on_event
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Header, Int64

POOL = 1 << 22
SMALL = 64
"""Three of four blobs are so small where small ones are allowed."""
TAKEN = 16
"""The checker says after so many blobs how many it has."""


class PusherParameters(Parameters):
    """Of which sizes blobs are pushed, and how fast."""

    topic: str = "blobs"
    least: int = 1 << 20
    most: int = 1 << 20
    window: int = 0
    """So many blobs may be under way; 0: a timer pushes, whatever becomes of them."""
    rate_hz: float = 100.0
    depth: int = 64


class Pusher(Node):
    """Pushes blobs of random bytes."""

    parameters: PusherParameters

    def declare(self) -> None:
        given = self.parameters
        self.pool = np.frombuffer(random.Random(1).randbytes(POOL), np.uint8)  # the same bytes every time
        self.sent = self.taken = 0
        self.out = self.create_publisher(Image, given.topic, qos=QoS(depth=given.depth))
        if given.window:
            self.create_subscription(Int64, f"{given.topic}_taken", self.on_taken, qos=QoS(depth=64))
        else:
            self.create_timer(1 / given.rate_hz, self.push)

    async def start(self) -> None:
        now_ns = self.clock.now_ns()
        self.header = Header(stamp=Time(sec=now_ns // 10**9, nanosec=now_ns % 10**9), frame_id="")

    async def run(self) -> None:
        self.fill()

    def on_taken(self, taken: Int64) -> None:
        self.taken = taken.data
        self.fill()

    def fill(self) -> None:
        given = self.parameters
        while self.sent < self.taken + given.window:
            self.push()

    def push(self) -> None:
        given = self.parameters
        self.sent += 1
        most = given.most if self.sent % 4 == 0 or given.least > SMALL else SMALL
        size = given.least + self.sent * 7919 % (most - given.least + 1)
        begin = self.sent * 104_729 % (POOL - size)
        data = self.pool[begin : begin + size]
        crc = zlib.crc32(data, self.sent)
        self.out.publish(Image(header=self.header, height=self.sent, width=crc, data=data))

    @on_event("blobs")
    def on_matched(self, event: PublisherMatched) -> None:
        self.log.info("readers", current=event.current)


class CheckerParameters(Parameters):
    """How many blobs are expected, and with how much room."""

    topic: str = "blobs"
    count: int = 0
    depth: int = 64


class Checker(Node):
    """Checks blobs, and logs the result once it has so many, and when it stops."""

    parameters: CheckerParameters

    def declare(self) -> None:
        given = self.parameters
        self.received = self.wrong = self.disorder = self.gaps = 0
        self.last: dict[Any, int] = {}
        self.blobs = self.create_subscription(Image, given.topic, self.on_blob, qos=QoS(depth=given.depth))
        self.taken = self.create_publisher(Int64, f"{given.topic}_taken", qos=QoS(depth=64))

    def on_blob(self, blob: Image) -> None:
        life, number = (blob.header.stamp.sec, blob.header.stamp.nanosec), blob.height
        self.received += 1
        self.wrong += zlib.crc32(blob.data, number) != blob.width
        if life not in self.last:
            self.log.info("first")
        last = self.last.get(life, 0)
        self.disorder += number <= last
        self.gaps += number > last + 1
        self.last[life] = number
        if self.received % TAKEN == 0:
            self.taken.publish(Int64(data=self.received))
        if self.received == self.parameters.count:
            self.tell("complete")

    async def stop(self) -> None:
        self.tell("checked")

    def tell(self, event: str) -> None:
        self.log.info(
            event,
            received=self.received,
            wrong=self.wrong,
            disorder=self.disorder,
            gaps=self.gaps,
            lives=len(self.last),
        )

    @on_event("blobs")
    def on_matched(self, event: SubscriptionMatched) -> None:
        self.log.info("writers", current=event.current)
