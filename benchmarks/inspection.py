"""What being looked into costs, and how fast messages cross a process boundary, beside Zenoh alone.

Run it with `python benchmarks/inspection.py`. Each figure is the best of several rounds, since other programs only ever
make it slower. Nothing is asserted.
"""

import asyncio
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median, quantiles

sys.path.insert(0, str(Path(__file__).parents[1]))
os.environ.setdefault("BUSFLOW_RUNTIME_DIR", tempfile.mkdtemp(prefix="bf", dir="/tmp"))  # the listeners look there too

import zenoh

import busflow
from busflow import Node, publisher, subscription
from busflow.msgs.std_msgs import Float64, UInt8MultiArray
from busflow.wire.client.client import join
from busflow.wire.mirror.membership import Inspection
from busflow.wire.zenoh.session import open_session

SIZES = {"8 B": 8, "320 B": 320, "64 KB": 65_536, "1 MB": 1 << 20, "6 MB": 6_220_800}
RATES = {8: 1000, 320: 1000, 65_536: 1000, 1 << 20: 200, 6_220_800: 40}
"""Messages a second while latency is measured."""
QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
ROUNDS, PUBLISHES, SECONDS = (1, 2_000, 0.02) if QUICK else (7, 200_000, 1.0)
PATIENCE_S = 2.0 if QUICK else 20.0
"""How long a message is waited for that may be lost."""


class Source(Node):
    number = publisher(Float64, "number")
    block = publisher(UInt8MultiArray, "block")


class Sink(Node):
    @subscription("number")
    def hear(self, number: Float64) -> None:
        pass


async def publish_costs() -> None:
    print(f"\npublish, ns of CPU time a message\n{'':28}{'0 subscriptions':>16}{'1, full queue':>16}")
    for name, inspect in (("--no-inspect", False), ("looked into by nobody", True), ("--no-inspect, again", False)):
        row = []
        for subscriptions in (0, 1):
            async with busflow.launch(Source, inspect=inspect) as graph:
                waiting = [graph.subscribe(Float64, "number") for _ in range(subscriptions)]
                await asyncio.sleep(0.05)
                publish = graph.node(Source).number.publish
                row.append(min(publish_time(publish, Float64(data=1.0)) for _ in range(ROUNDS)))
                del waiting
        print(f"{name:28}" + "".join(f"{seconds / PUBLISHES * 1e9:16.0f}" for seconds in row))


def publish_time(publish: Callable[[Float64], None], message: Float64) -> float:
    began = time.thread_time()
    for _ in range(PUBLISHES):
        publish(message)
    return time.thread_time() - began


# Across processes: this program publishes, and starts itself again to listen.


def listen(kind: str, count: int) -> None:
    """Receive, and print latencies in µs and the rate of what came, as JSON."""
    from busflow.wire.zenoh.run_directory import find_run

    arrived: list[tuple[int, int]] = []
    ended = threading.Event()

    def take(sent_ns: int) -> None:
        arrived.append((sent_ns, time.time_ns()))
        if len(arrived) == count:
            ended.set()

    if kind == "zenoh":
        session = open_session(find_run().directory)
        callback = zenoh.handlers.Callback(
            lambda sample: (sample.payload.to_bytes(), take(int(sample.attachment.to_bytes()))), indirect=False
        )
        way = session.declare_subscriber("raw", callback)
        print("listening", flush=True)
        ended.wait(PATIENCE_S)
        way.undeclare()
        session.close()
    else:
        with join() as peer, peer.listen(peer.graph().topic("block"), depth=100_000) as listener:
            print("listening", flush=True)
            while len(arrived) < count and (received := listener.get(2)) is not None:
                take(received.stamp_ns)
    late_us = sorted((there - sent) / 1000 for sent, there in arrived)
    took_s = (arrived[-1][1] - arrived[0][0]) / 1e9 if arrived else 1.0
    print(json.dumps({"late_us": late_us, "rate": len(arrived) / took_s, "lost": count - len(arrived)}), flush=True)


async def send(kind: str, size: int, count: int, rate: float | None) -> dict[str, object]:
    """Publish so many messages, at a rate or as fast as it goes, to a listener in another process."""
    async with busflow.launch(Source, inspect="bench") as graph:
        command = [sys.executable, __file__, "listen", kind, str(count), *(["--quick"] if QUICK else [])]
        listener = await asyncio.create_subprocess_exec(*command, stdout=subprocess.PIPE, limit=1 << 24)
        await listener.stdout.readline()
        await asyncio.sleep(0.2)
        message = UInt8MultiArray(data=bytes(size))
        block = graph.node(Source).block
        session = busflow_session(graph)
        raw = session.declare_publisher("raw", congestion_control=zenoh.CongestionControl.DROP)
        payload = bytes(size)

        def put() -> None:
            if kind == "zenoh":
                raw.put(payload, attachment=str(time.time_ns()))
            else:
                block.publish(message)

        began = time.perf_counter()
        for number in range(count):
            put()
            if rate is not None:
                await asyncio.sleep(max(0.0, began + (number + 1) / rate - time.perf_counter()))
            elif size >= 65_536 or number % 32 == 31:
                await asyncio.sleep(size / 2e9)  # as fast as a listener in Python can follow, or nearly
        told = json.loads(await listener.stdout.readline())
        await listener.wait()
        return told


def busflow_session(graph: busflow.Graph) -> zenoh.Session:
    """The session that the graph has already, so that both ways share one link."""
    (inspection,) = (each for each in graph.course.extensions if isinstance(each, Inspection))
    return inspection._mirror._session  # noqa: SLF001  # one link for both, or the comparison is none


def crossings() -> None:
    print("\nto another process: latency in µs, and the rate of what arrived, beside Zenoh alone")
    heads = ("p50", "p99", "zenoh p50", "zenoh p99", "ratio", "msg/s", "zenoh", "ratio", "lost", "zenoh")
    print(f"{'':8}" + "".join(f"{head:>11}" for head in heads))
    for name, size in [*SIZES.items()][-1 if QUICK else 0 :]:
        found = {}
        for kind in ("busflow", "zenoh"):
            rate = RATES[size]
            paced = asyncio.run(send(kind, size, max(30, int(rate * SECONDS)), rate))
            count = 20_000 if size < 10_000 else 2_000 if size < 100_000 else 100
            fast = asyncio.run(send(kind, size, 30 if QUICK else count, None))
            late_us = paced["late_us"]
            p99 = quantiles(late_us, n=100)[98] if len(late_us) > 1 else late_us[0]  # the others may be lost
            found[kind] = (median(late_us), p99, fast["rate"], fast["lost"])
        ours, theirs = found["busflow"], found["zenoh"]
        row = (*ours[:2], *theirs[:2], ours[0] / theirs[0], ours[2], theirs[2], ours[2] / theirs[2], ours[3], theirs[3])
        print(f"{name:8}" + "".join(f"{value:11.2f}" if value < 100 else f"{value:11.0f}" for value in row))


async def command_times() -> None:
    print("\nwall time of commands while a graph runs, ms")
    async with busflow.launch(Source, Sink, inspect="bench"):
        for words in (["topic", "list"], ["node", "list"], ["ps"]):
            took = []
            for _ in range(ROUNDS):
                began = time.perf_counter()
                process = await asyncio.create_subprocess_exec(
                    sys.executable, "-m", "busflow", *words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
                )
                code = await process.wait()
                took.append((time.perf_counter() - began) * 1000)
            print(f"busflow {' '.join(words):14}{min(took):8.0f}" + (f"   exit code {code}" if code else ""))


if __name__ == "__main__":
    if sys.argv[1:2] == ["listen"]:
        listen(sys.argv[2], int(sys.argv[3]))
    else:
        asyncio.run(publish_costs())
        crossings()
        asyncio.run(command_times())
