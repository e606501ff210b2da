"""A run and a session of ROS 2 beside two sessions of ROS 2, over Zenoh: `python benchmarks/ros2.py` prints both.

The sessions are raw ones with the settings of `rmw_zenoh`, in two processes; they find each other at a router and then
link directly. One-way times are by the wall clock of one machine, from the stamp in the attachment. Rounds alternate,
so that a busy machine slows down all alike; the median round counts.
"""

from __future__ import annotations

import asyncio
import json
import statistics
import struct
import sys
import time
from collections.abc import AsyncGenerator, Callable, Generator
from contextlib import asynccontextmanager, contextmanager
from typing import Any

import numpy as np
import zenoh

import busflow
from busflow import Message, Node, QoS, publisher
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import UInt8Array
from busflow.launchfile.model.description import LaunchDescription
from busflow.launchfile.model.network import NetworkAddress
from busflow.launchfile.model.ros2 import Ros2Spec
from busflow.launchfile.yaml.value import Origin, StatedBy

PORT = 27447
ROUNDS, TIMES = 3, 200
BURST = 5000
PERIODS_S = {320: 0.005, 64_000: 0.005, 1_000_000: 0.02}
"""By the size of a message, the time from one to the next. At 200 Hz a megabyte fills a core; then the raw session's
loop stands still in `put`, before the stamp, and a node's messages wait in a queue, after it.
"""
SETTINGS = {
    "mode": "peer",
    "connect/endpoints": [f"tcp/localhost:{PORT}"],
    "listen/endpoints": ["tcp/localhost:0"],
    "scouting/multicast/enabled": False,
    "scouting/gossip/autoconnect_strategy": {"peer": {"to_router": "always", "to_peer": "greater-zid"}},
    "transport/shared_memory/enabled": False,  # as `rmw_zenoh` has it
}
Publish = Callable[[], None]


class Blob(Message, package="benchmarks"):
    """Bytes."""

    data: UInt8Array


class Sending(Node):
    """Publishes as ROS 2's sensors do."""

    blob = publisher(Blob, "blob", qos=QoS(depth=1000))


SUPPORT = TypeSupport(Blob)
KEY = f"0/blob/benchmarks::msg::dds_::Blob_/{SUPPORT.type_hash}"


@contextmanager
def opened(settings: dict[str, Any]) -> Generator[Any]:
    """A raw session."""
    config: Any = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        yield session


def receive() -> None:
    """Print, for each line of the input, the one-way times since the line before, and the rate."""
    times: list[tuple[int, int]] = []

    def on_sample(sample: Any) -> None:
        _, stamp, _ = struct.unpack_from("<qqB", sample.attachment.to_bytes())
        sample.payload.to_bytes()
        times.append((stamp, time.time_ns()))

    with opened(SETTINGS) as session:
        subscriber = session.declare_subscriber(KEY, zenoh.handlers.Callback(on_sample, indirect=False))
        print("ready", flush=True)
        for _ in sys.stdin:
            took, times[:] = sorted((there - here) / 1e3 for here, there in times), []
            print(json.dumps(took), flush=True)
        subscriber.undeclare()


@asynccontextmanager
async def of_busflow(size: int) -> AsyncGenerator[Publish]:
    """A node's publisher, whose run stands in for the router."""
    router = NetworkAddress("tcp", "127.0.0.1", PORT, Origin(StatedBy.CALLER))
    description = LaunchDescription("bench", (), ros2=Ros2Spec(0, router=router))
    message = Blob(data=np.zeros(size, np.uint8))
    async with busflow.launch(description, Sending, inspect=True) as graph:
        node = graph.node(Sending)
        yield lambda: node.blob.publish(message)


@asynccontextmanager
async def of_zenoh(size: int) -> AsyncGenerator[Publish]:
    """A publisher of a raw session, beside a router."""
    router = {"mode": "router", "listen/endpoints": [f"tcp/127.0.0.1:{PORT}"], "scouting/multicast/enabled": False}
    payload, count = SUPPORT.encode(Blob(data=np.zeros(size, np.uint8))), 0
    with opened(router), opened(SETTINGS) as session:
        way = session.declare_publisher(KEY, congestion_control=zenoh.CongestionControl.DROP)

        def publish() -> None:
            nonlocal count
            count += 1
            way.put(payload, attachment=struct.pack("<qqB", count, time.time_ns(), 16) + bytes(16))

        yield publish


async def measure(publish: Publish, period_s: float) -> tuple[list[float], float]:
    """One-way times at a steady rate, and the messages a second of a burst that arrive."""
    child = await asyncio.create_subprocess_exec(
        *(sys.executable, __file__, "receive"),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        limit=1 << 24,
    )
    if child.stdin is None or child.stdout is None:
        raise RuntimeError("no pipes")
    entry, lines = child.stdin, child.stdout

    async def read() -> list[float]:
        entry.write(b"\n")
        return json.loads(await lines.readline())

    await lines.readline()
    while not await read():
        publish()
        await asyncio.sleep(0.05)
    await read()
    for _ in range(TIMES):
        publish()
        await asyncio.sleep(period_s)
    await asyncio.sleep(0.2)
    times = await read()
    began = time.perf_counter()
    for number in range(BURST // 10):
        publish()
        if number % 10 == 9:
            await asyncio.sleep(0)
    took = time.perf_counter() - began
    await asyncio.sleep(0.5)
    arrived = len(await read())
    entry.close()
    await child.wait()
    return times, arrived / took


async def main(*, quick: bool) -> None:
    """Print a row for each size and sender; a quick round has one size, once."""
    sizes, rounds = ([*PERIODS_S][: 1 if quick else None], 1 if quick else ROUNDS)
    print(f"{'bytes':>9}  {'sender':<8} {'p50 µs':>8} {'p99 µs':>8} {'per s':>8}")
    for size in sizes:
        found: dict[str, list[tuple[float, float, float]]] = {"zenoh": [], "busflow": []}
        for _ in range(rounds):
            for name, opening in (("zenoh", of_zenoh), ("busflow", of_busflow)):
                async with opening(size) as publish:
                    times, rate = await measure(publish, PERIODS_S[size])
                found[name].append((times[len(times) // 2], times[len(times) * 99 // 100], rate))
        medians = {name: [statistics.median(each) for each in zip(*rows, strict=True)] for name, rows in found.items()}
        for name, (p50, p99, rate) in medians.items():
            print(f"{size:>9}  {name:<8} {p50:8.0f} {p99:8.0f} {rate:8.0f}")
        print(f"{'':>9}  ratio    {medians['busflow'][0] / medians['zenoh'][0]:8.2f}")


if __name__ == "__main__":
    if sys.argv[1:] == ["receive"]:
        receive()
    else:
        asyncio.run(main(quick=sys.argv[1:] == ["--quick"]))
