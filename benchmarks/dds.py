"""Latency and rate between a node and a program of DDS alone, by the bridge, beside its two hops alone.

    python -m benchmarks.dds                    # the table; `--seconds 10` measures for longer

The rows of a payload are measured in turn, in one run of this program. Writer, reader and bridge are processes of
their own. A message carries the time at which it was made, of the machine's monotonic clock; latency is that from there
to the moment at which the reader has the message, decoded. That has Python's part in it, Cyclone's as ours.

What crosses the bridge takes one hop of Zenoh, over the run's socket, and one of DDS. Two programs of `cyclonedds` and
two of `zenoh` show what these cost alone; the latter exchange bytes of the same number and decode nothing but the time.
The first ratio is to DDS alone, the second to both hops.
"""

import argparse
import json
import os
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import zenoh
from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from busflow.dds.participant import configuration
from busflow.wire.zenoh.session import open_session

sys.path.insert(0, str(Path(__file__).parents[1]))  # where this is run as a file
from tests.dds.ros2_types import Float64, Header, Image, Imu, Time  # as above

DOMAIN = 29
QOS = Qos(
    Policy.Reliability.Reliable(duration(seconds=1)),
    Policy.History.KeepLast(1000),
    Policy.DataRepresentation(use_cdrv0_representation=True),
)
PAYLOADS = {"float64": 1000, "imu": 1000, "image 64 kB": 20}
"""Each with its rate in the measure of latency, Hz; cyclonedds takes 60 ns for each byte of an image."""
IMAGE_BYTES = 64_000
BYTES = {"float64": 12, "imu": 316, "image 64 kB": 64_044}
"""The size of each, encoded."""
WARM_UP = 0.2
"""The share of the first messages that does not count."""


KINDS = {"float64": Float64, "imu": Imu, "image 64 kB": Image}
PIXELS = bytes(range(250)) * (IMAGE_BYTES // 250)


def made(payload: str) -> Any:
    """Return a message of Cyclone's that carries the time."""
    now_ns = time.monotonic_ns()
    if payload == "float64":
        return Float64(now_ns / 1e9)
    header = Header(Time(*divmod(now_ns, 1_000_000_000)))
    return Imu(header=header) if payload == "imu" else Image(header, 1, IMAGE_BYTES, "mono8", 0, IMAGE_BYTES, PIXELS)


def age_s(message: Any) -> float:
    """Return the age of a message of Cyclone's or of busflow's."""
    now = time.monotonic_ns() / 1e9
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return now - (message.data if stamp is None else stamp.sec + stamp.nanosec / 1e9)


def participant() -> DomainParticipant:
    participant.domain = Domain(DOMAIN, configuration(None))  # which lives as long as the function
    return DomainParticipant(DOMAIN)


def pace(rate_hz: float, seconds: float, publish: Any) -> None:
    """Publish at a rate, or as fast as it goes with rate 0."""
    start = time.monotonic()
    number = 0
    while (now := time.monotonic()) < start + seconds:
        if rate_hz:
            number += 1
            time.sleep(max(0.0, start + number / rate_hz - now))
        publish()


def write_dds(payload: str, rate_hz: float, seconds: float) -> None:
    member = participant()
    writer = DataWriter(member, Topic(member, "rt/bench", KINDS[payload]), qos=QOS)
    while not writer.matched_sub:
        time.sleep(0.01)
    time.sleep(0.5)  # until the run knows the writer
    pace(rate_hz, seconds, lambda: writer.write(made(payload)))
    time.sleep(0.5)


def read_dds(payload: str, seconds: float) -> list[float]:
    member = participant()
    reader = DataReader(member, Topic(member, "rt/bench", KINDS[payload]), qos=QOS)
    waiting = WaitSet(member)
    waiting.attach(ReadCondition(reader, SampleState.NotRead | ViewState.Any | InstanceState.Any))
    ages: list[float] = []
    end = time.monotonic() + 20 + seconds
    while time.monotonic() < end:
        count = waiting.wait(duration(seconds=1))
        if not count and ages:
            break
        ages += [age_s(sample) for sample in reader.take(N=1000) if sample.sample_info.valid_data]
    return ages


def write_zenoh(payload: str, rate_hz: float, seconds: float) -> None:
    session, rest = open_session(own_folder(), listen="main.sock"), bytes(BYTES[payload] - 8)
    way: Any = session.declare_publisher("bench", congestion_control=zenoh.CongestionControl.DROP)
    while not way.matching_status.matching:
        time.sleep(0.01)
    time.sleep(0.5)
    pace(rate_hz, seconds, lambda: way.put(struct.pack("<d", time.monotonic_ns() / 1e9) + rest))
    time.sleep(0.5)
    session.close()


def read_zenoh(seconds: float) -> list[float]:
    while not (own_folder() / "main.sock").exists():
        time.sleep(0.01)
    ages: list[float] = []

    def on_sample(sample: zenoh.Sample) -> None:
        (made_s,) = struct.unpack_from("<d", sample.payload.to_bytes())
        ages.append(time.monotonic_ns() / 1e9 - made_s)

    with open_session(own_folder()) as session:
        session.declare_subscriber("bench", zenoh.handlers.Callback(on_sample, indirect=False))
        time.sleep(seconds + 2)
    return ages


def own_folder() -> Path:
    return Path(os.environ["BUSFLOW_RUNTIME_DIR"])


def busflow_message(payload: str, pixels: Any) -> Any:
    """Return a message of busflow's that carries the time."""
    from busflow.msgs import builtin_interfaces, sensor_msgs, std_msgs

    now_ns = time.monotonic_ns()
    if payload == "float64":
        return std_msgs.Float64(data=now_ns / 1e9)
    sec, nanosec = divmod(now_ns, 1_000_000_000)
    header = std_msgs.Header(stamp=builtin_interfaces.Time(sec=sec, nanosec=nanosec))
    if payload == "imu":
        return sensor_msgs.Imu(header=header)
    return sensor_msgs.Image(header=header, height=1, width=IMAGE_BYTES, step=IMAGE_BYTES, data=pixels)


def busflow_node(payload: str, rate_hz: float, seconds: float, *, publishes: bool) -> list[float]:
    """Run a node that publishes or receives, in a run that the bridge finds; return the ages of what it received."""
    import asyncio

    import numpy as np

    import busflow

    pixels = np.frombuffer(PIXELS, np.uint8)
    message_type: Any = type(busflow_message(payload, pixels))
    ages: list[float] = []

    class Bench(busflow.Node):
        def declare(self) -> None:
            self.came, self.done = asyncio.Event(), asyncio.Event()
            if publishes:
                self.out = self.create_publisher(message_type, "bench", qos=busflow.QoS(depth=1000))
            else:
                self.create_subscription(message_type, "bench", self.on_message, qos=busflow.QoS(depth=1000))

        def on_message(self, message: Any) -> None:
            ages.append(age_s(message))
            self.came.set()

        async def run(self) -> None:
            await (self.publish_all() if publishes else self.came.wait())
            await asyncio.sleep(1 if publishes else seconds + 1.5)
            self.done.set()

        async def publish_all(self) -> None:
            while not self.out.is_received:  # noqa: ASYNC110  # no event says it
                await asyncio.sleep(0.01)
            await asyncio.sleep(0.5)  # until the bridge's writer and the reader know each other
            start, number = time.monotonic(), 0
            while (now := time.monotonic()) < start + seconds:
                number += 1
                if rate_hz or number % 20 == 0:
                    await asyncio.sleep(max(0.0, start + number / rate_hz - now) if rate_hz else 0)
                self.out.publish(busflow_message(payload, pixels))

    async def main() -> None:
        node = Bench()
        async with busflow.launch(node, inspect="bench"):
            await node.done.wait()

    asyncio.run(main())
    return ages


def measure(row: str, payload: str, rate_hz: float, seconds: float) -> list[float]:
    """Start the processes of a row, and return the ages of the messages at the reader."""
    roles = {
        "DDS to DDS": ["write_dds", "read_dds"],
        "Zenoh to Zenoh": ["write_zenoh", "read_zenoh"],
        "busflow to DDS": ["publish", "bridge", "read_dds"],
        "DDS to busflow": ["receive", "bridge", "write_dds"],
    }[row]
    with tempfile.TemporaryDirectory(prefix="bf", dir="/tmp") as folder, ExitStack() as ending:
        environment = {**os.environ, "BUSFLOW_RUNTIME_DIR": folder}
        processes: dict[str, subprocess.Popen[str]] = {}
        for role in roles:
            command = [sys.executable, "-m", "benchmarks.dds", "--role", role, payload, str(rate_hz), str(seconds)]
            if role == "bridge":
                wait_for_run(environment)
                command = [sys.executable, "-m", "busflow", "dds", "--run", "bench", "--domain", str(DOMAIN)]
            process = subprocess.Popen(  # noqa: S603  # our own interpreter and our own arguments
                command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
            )
            ending.callback(process.kill)
            processes[role] = process
        reader = next(processes[role] for role in ("read_dds", "read_zenoh", "receive") if role in roles)
        out, error = reader.communicate(timeout=60 + seconds)
        if reader.returncode:
            raise RuntimeError(error)
        return json.loads(out)


def wait_for_run(environment: dict[str, str]) -> None:
    for _ in range(100):
        ps = subprocess.run(
            [sys.executable, "-m", "busflow", "ps"], capture_output=True, text=True, env=environment, check=False
        )
        if "bench" in ps.stdout:
            return


def play(role: str, payload: str, rate_hz: float, seconds: float) -> None:
    """Be one process of a row; a reader prints the ages of what it got."""
    roles: dict[str, Callable[[], list[float] | None]] = {
        "write_dds": lambda: write_dds(payload, rate_hz, seconds),
        "write_zenoh": lambda: write_zenoh(payload, rate_hz, seconds),
        "read_dds": lambda: read_dds(payload, seconds),
        "read_zenoh": lambda: read_zenoh(seconds),
        "publish": lambda: busflow_node(payload, rate_hz, seconds, publishes=True),
        "receive": lambda: busflow_node(payload, rate_hz, seconds, publishes=False),
    }
    print(json.dumps(roles[role]()))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3.0, help="how long each row publishes")
    parser.add_argument(
        "--quick", action="store_true", help="one payload, at its rate, for 0.2 s: to see that all works"
    )
    parser.add_argument("--role", nargs=4, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.role:
        role, payload, rate_hz, seconds = given.role
        play(role, payload, float(rate_hz), float(seconds))
        return
    print(f"{'payload':14}{'way':18}{'p50 µs':>10}{'p99 µs':>10}{'to DDS':>10}{'to both':>10}{'most per s':>12}")
    seconds = 0.2 if given.quick else given.seconds
    for payload, rate_hz in list(PAYLOADS.items())[: 1 if given.quick else None]:
        alone: list[float] = []
        for row in ("DDS to DDS", "Zenoh to Zenoh", "busflow to DDS", "DDS to busflow"):
            ages = measure(row, payload, rate_hz, seconds)
            ages = sorted(ages[int(len(ages) * WARM_UP) :])
            p50, p99 = statistics.median(ages) * 1e6, ages[int(len(ages) * 0.99)] * 1e6
            most = "" if given.quick else f"{len(measure(row, payload, 0, seconds)) / seconds:.0f}"
            ratios = f"{p50 / alone[0]:10.2f}{p50 / sum(alone):10.2f}" if len(alone) == 2 else " " * 20
            if len(alone) < 2:
                alone.append(p50)
            print(f"{payload:14}{row:18}{p50:10.0f}{p99:10.0f}{ratios}{most:>12}", flush=True)


if __name__ == "__main__":
    main()
