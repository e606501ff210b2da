"""A source of numbers, and readers that do something to their process while messages come; topics by the hundred."""

import os
import socket
import stat
from pathlib import Path

import numpy as np

from busflow import Node, Parameters, QoS, timer
from busflow.msgs.sensor_msgs import Image
from busflow.msgs.std_msgs import Int64

NOBODY = 65534


class Source(Node):
    """Publishes a number each millisecond."""

    def declare(self) -> None:
        self.numbers = self.create_publisher(Int64, "numbers")
        self.last = 0

    @timer(0.001, missed="burst")
    def count(self) -> None:
        self.last += 1
        self.numbers.publish(Int64(data=self.last))


class MeddlerParameters(Parameters):
    deed: str = ""


class Meddler(Node):
    """Does something to its process at its 100th number, and logs each 500th, and every gap."""

    parameters: MeddlerParameters

    def declare(self) -> None:
        self.received = self.last = 0
        self.create_subscription(Int64, "numbers", self.on_number, qos=QoS(depth=5000))

    def on_number(self, number: Int64) -> None:
        if number.data <= self.last:
            raise ValueError(f"{number.data} after {self.last}")
        if self.received and number.data != self.last + 1:
            self.log.info("gap", numbers=number.data - self.last - 1)
        self.last = number.data
        self.received += 1
        if self.received == 100:
            getattr(self, self.parameters.deed)()
        if self.received % 500 == 0:
            self.log.info("received", count=self.received)

    def nothing(self) -> None: ...

    def forks(self) -> None:
        """Have one child that closes everything and ends, and one that lives for as long as its parent."""
        if (closing := os.fork()) == 0:
            os.closerange(3, 4096)
            os._exit(0)
        os.waitpid(closing, 0)
        reading, writing = os.pipe()
        if os.fork() == 0:
            os.close(writing)
            os.read(reading, 1)
            os._exit(0)
        os.close(reading)

    def closes(self) -> None:
        """Close each connected socket that keeps packets apart."""
        for each in [*Path("/proc/self/fd").iterdir()]:
            if is_line(int(each.name)):
                os.close(int(each.name))

    def leaves(self) -> None:
        os.seteuid(NOBODY)


def is_line(descriptor: int) -> bool:
    try:
        if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
            return False
        duplicate = socket.socket(fileno=os.dup(descriptor))
    except OSError:  # it was that of the list
        return False
    with duplicate:
        kind, listens = (
            duplicate.getsockopt(socket.SOL_SOCKET, name) for name in (socket.SO_TYPE, socket.SO_ACCEPTCONN)
        )
        return kind == socket.SOCK_SEQPACKET and not listens


class ManyParameters(Parameters):
    topics: int = 200


class ManyTalker(Node):
    """Publishes three images of 60 kB on each topic."""

    parameters: ManyParameters

    def declare(self) -> None:
        self.outs = [self.create_publisher(Image, f"images_{at}") for at in range(self.parameters.topics)]

    async def run(self) -> None:
        for number in range(3):
            for out in self.outs:
                out.publish(Image(height=number, data=np.zeros(60_000, np.uint8)))


class ManyListener(Node):
    """Logs once it has all of them."""

    parameters: ManyParameters

    def declare(self) -> None:
        self.received = 0
        for at in range(self.parameters.topics):
            self.create_subscription(Image, f"images_{at}", self.on_image)

    def on_image(self, _image: Image) -> None:
        self.received += 1
        if self.received == 3 * self.parameters.topics:
            self.log.info("has all")
