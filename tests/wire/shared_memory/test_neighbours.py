"""Two processes of a run that read each other's memory, and what happens where one of them cannot."""

import asyncio
import os
import platform
import threading
from contextlib import asynccontextmanager

import numpy as np
import pytest

from busflow import Node, QoS, publisher, subscription
from busflow.msgs.sensor_msgs import Image
from tests.wire.mirror.processes import PATIENCE_S, Process, until

pytestmark = [
    pytest.mark.asyncio,
    pytest.mark.skipif(
        not hasattr(os, "memfd_create") or platform.machine() != "x86_64",
        reason="memory is shared on Linux, x86-64, only",
    ),
]

SIZE = 100_000


class Camera(Node):
    images = publisher(Image, "images")
    taken = 0

    def take(self, size: int = SIZE) -> None:
        self.taken += 1
        self.images.publish(Image(height=self.taken, data=np.full(size, self.taken % 256, np.uint8)))


class Viewer(Node):
    def declare(self) -> None:
        self.seen: list[int] = []

    @subscription("images", qos=QoS(depth=100))
    def see(self, image: Image) -> None:
        assert set(image.data.tolist()) == {image.height % 256}
        self.seen.append(image.height)


class Pair:
    """A camera and a viewer, in a process each."""

    def __init__(self, directory):
        self.eyes = Process(Camera, "eyes", directory, "screen")
        self.screen = Process(Viewer, "screen", directory, "eyes")

    @property
    def capacity(self) -> int:
        """Bytes that the camera's process shares."""
        return self._mirror(self.eyes)._connection.arenas.capacity

    @property
    def neighbours(self):
        """What the viewer's process shows of itself."""
        return self._mirror(self.screen)._connection.neighbours

    def wait_until_sent(self) -> None:
        """Stop the event loop, which both processes share, until the camera's images were sent."""
        sent = threading.Event()
        self._mirror(self.eyes)._connection.sender.hand(sent.set)
        assert sent.wait(PATIENCE_S)

    @staticmethod
    def _mirror(process):
        return process.membership._mirror

    async def shows(self, *sizes):
        """Publish images one by one, and wait until each has been seen."""
        camera, viewer = self.eyes.graph.node(Camera), self.screen.graph.node(Viewer)
        for size in sizes or [SIZE]:
            camera.take(size)
            await until(lambda: viewer.seen[-1:] == [camera.taken])
        assert viewer.seen == [*range(1, camera.taken + 1)]

    def shares(self):
        """Whether the camera's messages would go through memory now."""
        return any(outlet._memory._readers for outlet in self._mirror(self.eyes)._outlets.values())


@asynccontextmanager
async def pair(directory):
    made = Pair(directory)
    await asyncio.gather(made.eyes.graph.start(), made.screen.graph.start())
    await until(made.shares)
    yield made
    await asyncio.gather(made.eyes.graph.stop(), made.screen.graph.stop())


async def test_images_of_all_sizes_come_in_order(directory):
    async with pair(directory) as made:
        await made.shows(100, SIZE)
        assert made.capacity == 0, "the first large one is sent whole, as all before it"
        await made.shows(SIZE, 100, 3 * SIZE, 40 * SIZE, 100, SIZE)
        assert 16 * 40 * SIZE <= made.capacity <= 16 * 41 * SIZE


async def test_process_without_access_gets_messages_whole(directory, capsys):
    async with pair(directory) as made:
        await made.shows(SIZE, SIZE)
        for _ in range(2):
            made.neighbours.withdraw(PermissionError("not permitted"))
        await until(lambda: not made.shares())
        written = made.capacity
        await made.shows(SIZE, 80 * SIZE)
        assert made.capacity == written
    warned = "messages of other processes cannot be read from shared memory: not permitted"
    assert capsys.readouterr().err.count(warned) == 1


async def test_message_that_was_overwritten_is_lost(directory, limits):
    limits(slow_reader=0.0)
    async with pair(directory) as made:
        await made.shows(SIZE, SIZE)
        camera = made.eyes.graph.node(Camera)
        for _ in range(60):  # the viewer shares this loop: it reads nothing meanwhile
            camera.take()
        made.wait_until_sent()
        await until(lambda: made.screen.graph.node(Viewer).seen[-1:] == [camera.taken])
        seen = made.screen.graph.node(Viewer).seen
        assert seen == sorted(seen)
        topic = made.screen.graph.bus.topics["/images"]
        assert topic.losses == {"lost": camera.taken - len(seen)}
        assert len(seen) < camera.taken


@pytest.mark.parametrize("lacks", ["memfd_create", "proc"])
async def test_system_without_such_memory_sends_messages_whole(directory, monkeypatch, lacks):
    if lacks == "memfd_create":
        monkeypatch.delattr(os, "memfd_create")
    else:
        monkeypatch.setattr("busflow.wire.shared_memory.neighbours._PROC", directory / "proc")
    made = Pair(directory)
    await asyncio.gather(made.eyes.graph.start(), made.screen.graph.start())
    await made.shows(SIZE, SIZE, 80 * SIZE)
    assert (made.shares(), made.capacity) == (False, 0)
    await asyncio.gather(made.eyes.graph.stop(), made.screen.graph.stop())


async def test_no_memory_left_sends_messages_whole(directory, monkeypatch):
    monkeypatch.setattr("busflow.wire.shared_memory.arena.MOST_BYTES", 1 << 20)
    async with pair(directory) as made:
        await made.shows(SIZE, SIZE, 80 * SIZE)
        assert made.capacity == 0
