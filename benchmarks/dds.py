"""Latency and rate between a node and a program of DDS alone, by the bridge, beside two programs of DDS alone.

    python -m benchmarks.dds                    # the table; `--seconds 10` measures for longer

The rows of a payload are measured in turn, in one run of this program. Writer, reader and bridge are processes of
their own. A message carries the time at which it was made, of the machine's monotonic clock; latency is that from there
to the moment at which the reader has the message, decoded. That has Python's part in it, Cyclone's as ours.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from busflow.dds.participant import configuration

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
            await asyncio.sleep(4)  # until the bridge and the reader are there
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
        reader = processes["read_dds" if "read_dds" in roles else "receive"]
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
    if role == "write_dds":
        write_dds(payload, rate_hz, seconds)
        return
    ages = (
        read_dds(payload, seconds)
        if role == "read_dds"
        else busflow_node(payload, rate_hz, seconds, publishes=role == "publish")
    )
    print(json.dumps(ages))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=3.0, help="how long each row publishes")
    parser.add_argument("--quick", action="store_true", help="one payload, for half a second: to see that all works")
    parser.add_argument("--role", nargs=4, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.role:
        role, payload, rate_hz, seconds = given.role
        play(role, payload, float(rate_hz), float(seconds))
        return
    print(f"{'payload':14}{'way':18}{'p50 µs':>10}{'p99 µs':>10}{'ratio of p50':>14}{'most per s':>12}")
    seconds = 0.5 if given.quick else given.seconds
    for payload, rate_hz in list(PAYLOADS.items())[: 1 if given.quick else None]:
        base = None
        for row in ("DDS to DDS", "busflow to DDS", "DDS to busflow"):
            ages = measure(row, payload, rate_hz, seconds)
            ages = sorted(ages[int(len(ages) * WARM_UP) :])
            p50, p99 = statistics.median(ages) * 1e6, ages[int(len(ages) * 0.99)] * 1e6
            base = base or p50
            most = len(measure(row, payload, 0, seconds)) / seconds
            print(f"{payload:14}{row:18}{p50:10.0f}{p99:10.0f}{p50 / base:14.2f}{most:12.0f}", flush=True)


if __name__ == "__main__":
    main()
