"""What recording costs: on the loop and in all, beside the writers of `mcap` and rosbags.

    python benchmarks/recording.py [SECONDS]

Three loads (an Imu, joint states of 31 joints, an image of 6 MB) are encoded by busflow and written by each writer.
busflow's own is measured as a run has it, with a thread that writes, while 5,000 small messages a second are published,
or 20 images; the others write where they are called. All times are those of the processor. Then the humanoid's rate:
the share of a core with and without recording.
"""

from __future__ import annotations

import asyncio
import resource
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as RosbagsWriter
from rosbags.typesys import Stores, get_typestore

import busflow
from busflow import Node, Parameters, publisher, timer
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Message
from busflow.msgs.geometry_msgs import Vector3
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.recording.recorder.recorder import record_graph
from busflow.runner.graph import Graph

JOINTS = 31
IMAGE_BYTES = 6_000_000
_RANDOM = np.random.default_rng(0)


def imu() -> Imu:
    x, y, z = _RANDOM.normal(size=3)
    return Imu(angular_velocity=Vector3(x=x, y=y, z=z), linear_acceleration=Vector3(x=y, y=z, z=9.8))


def joints() -> JointState:
    position, velocity, effort = _RANDOM.normal(size=(3, JOINTS))
    names = [f"joint_{n}" for n in range(JOINTS)]
    return JointState(name=names, position=position, velocity=velocity, effort=effort)


def image() -> Image:
    data = np.repeat(_RANDOM.integers(0, 256, IMAGE_BYTES // 8, dtype=np.uint8), 8)
    return Image(height=1000, width=2000, encoding="rgb8", step=6000, data=data)


def cpu_s() -> float:
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def loads(seconds: float) -> list[tuple[str, list[Message]]]:
    """Each with its messages, of which no two are the same."""
    scale = seconds / 10
    return [
        ("Imu, 324 B", [imu() for _ in range(int(30_000 * scale))]),
        ("31 joints, 1.3 kB", [joints() for _ in range(int(20_000 * scale))]),
        ("image, 6 MB", [image() for _ in range(max(4, int(40 * scale)))]),
    ]


class Source(Node):
    """Publishes nothing by itself."""


_BURST = 100
_BURSTS_HZ = 50.0
"""So many small messages are published at once, so often; of images, one."""
_IMAGES_HZ = 20.0


def bursts(messages: Sequence[Message]) -> Iterator[Sequence[Message]]:
    count = 1 if isinstance(messages[0], Image) else _BURST
    yield from (messages[at : at + count] for at in range(0, len(messages), count))


def busflow_writes(messages: Sequence[Message], path: Path, compression: str) -> tuple[float, float]:
    """Seconds of the processor, on the loop and in all, of which the end of the file is part."""
    on_loop = before = 0.0

    async def main() -> None:
        nonlocal on_loop, before
        async with busflow.launch(Source, record={"to": str(path), "compression": compression}) as graph:
            out = graph.advertise(type(messages[0]), "/load")
            before = cpu_s()
            hz = _IMAGES_HZ if isinstance(messages[0], Image) else _BURSTS_HZ
            for burst in bursts(messages):
                start = time.thread_time()
                for message in burst:
                    out.publish(message)
                took = time.thread_time() - start
                on_loop += took
                await asyncio.sleep(max(0.0, 1 / hz - took))
        told = graph.report().recording
        if told is not None and not told.complete:
            print(f"    {told.missed} of {told.missed + told.recorded} were missed")

    asyncio.run(main())
    return on_loop, cpu_s() - before


def mcap_writes(messages: Sequence[Message], path: Path, compression: str) -> tuple[float, float]:
    """As a program would that writes where it publishes."""
    from mcap.writer import CompressionType

    before = cpu_s()
    support = TypeSupport(type(messages[0]))
    with path.open("wb") as file:
        writer = McapWriter(file, compression=CompressionType[compression.upper()])
        writer.start("ros2")
        schema = writer.register_schema(support.name, "ros2msg", support.definition.encode())
        channel = writer.register_channel("/load", "cdr", schema)
        start = time.thread_time()
        for n, message in enumerate(messages):
            writer.add_message(channel, n, support.encode(message), n)
        on_loop = time.thread_time() - start
        writer.finish()
    return on_loop, cpu_s() - before


def rosbags_writes(messages: Sequence[Message], path: Path, compression: str) -> tuple[float, float]:
    """With busflow's own encoding, which is quicker than that of rosbags."""
    from rosbags.rosbag2 import CompressionMode

    before = cpu_s()
    support = TypeSupport(type(messages[0]))
    writer = RosbagsWriter(path.with_suffix(""), version=9, storage_plugin=StoragePlugin.MCAP)
    if compression == "zstd":
        writer.set_compression(CompressionMode.STORAGE, writer.CompressionFormat.ZSTD)
    with writer:
        store = get_typestore(Stores.ROS2_JAZZY)
        connection = writer.add_connection("/load", support.name, typestore=store)
        start = time.thread_time()
        for n, message in enumerate(messages):
            writer.write(connection, n, support.encode(message))
        on_loop = time.thread_time() - start
    return on_loop, cpu_s() - before


Writes = Callable[[Sequence[Message], Path, str], tuple[float, float]]
WRITERS: dict[str, tuple[Writes, tuple[str, ...]]] = {
    "busflow": (busflow_writes, ("none", "lz4", "zstd")),
    "mcap": (mcap_writes, ("none", "lz4", "zstd")),
    "rosbags": (rosbags_writes, ("none",)),
}


class HumanoidParameters(Parameters):
    rate_hz: float = 100.0


class Humanoid(Node):
    """Publishes what a humanoid's sensors do: an Imu and 31 joints, with a camera if asked."""

    parameters: HumanoidParameters
    imu = publisher(Imu, "imu/data")
    joints = publisher(JointState, "joint_states")

    @timer(hz="rate_hz")
    def sense(self) -> None:
        self.imu.publish(imu())
        self.joints.publish(joints())


def humanoid_share(path: Path | None, seconds: float, rate_hz: float) -> float:
    """The share of a core that a run takes, ticks that a busy machine has missed made up for."""
    graph = Graph([Humanoid(rate_hz=rate_hz)])
    if path is not None:
        record_graph(graph, path)
    share = 0.0

    async def main() -> None:
        nonlocal share
        async with graph:
            await asyncio.sleep(0.3)
            before, ticks = cpu_s(), graph.report().timers[0].fired
            await asyncio.sleep(seconds)
            share = (cpu_s() - before) / (graph.report().timers[0].fired - ticks) * rate_hz

    asyncio.run(main())
    return share


def main(seconds: float) -> None:
    with tempfile.TemporaryDirectory() as folder:
        print("load               writer   chunks   µs/msg on the loop   µs/msg of CPU in all   MB/s of CPU   file")
        for load, messages in loads(seconds):
            encode = TypeSupport(type(messages[0])).encode
            size = sum(len(encode(each)) for each in messages)
            for name, (write, compressions) in WRITERS.items():
                for compression in compressions:
                    path = Path(folder) / f"{name}-{compression}-{load[:3]}.mcap"
                    on_loop, cpu = write(messages, path, compression)
                    count = len(messages)
                    written = sum(each.stat().st_size for each in _files(path))
                    print(
                        f"{load:18} {name:8} {compression:8} {on_loop / count * 1e6:18.1f} {cpu / count * 1e6:22.1f}"
                        f" {size / cpu / 1e6:13.0f} {written / size:7.0%}"
                    )
                    for each in _files(path):
                        each.unlink()
        for rate_hz in (100.0, 1000.0):
            idle = humanoid_share(None, seconds / 2, rate_hz)
            busy = humanoid_share(Path(folder) / f"humanoid-{rate_hz:g}.mcap", seconds / 2, rate_hz)
            print(f"humanoid at {rate_hz:g} Hz: {idle:.1%} of a core, recorded {busy:.1%}")


def _files(path: Path) -> list[Path]:
    return [path] if path.exists() else [each for each in path.with_suffix("").iterdir() if each.is_file()]


if __name__ == "__main__":
    argument: Any = sys.argv[1:] or ["10"]
    main(float(argument[0]))
