"""The trace: a line for everything that happens, the same bytes wherever and however often it runs."""

import asyncio
import contextlib
import hashlib
import math
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow import Node, Parameters, QoS, ServiceError, client, publisher, service, subscription, timer
from busflow.bus.bus import BusObserver
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Float64, Int64, String
from busflow.msgs.std_srvs import Trigger
from busflow.testing import harness, virtual_time
from busflow.testing.trace import Trace, content_hash

ROOT = Path(__file__).parents[2]


class Counter(Node):
    numbers = publisher(Int64, "numbers")

    async def start(self) -> None:
        self.count = 0

    @timer(0.1)
    def tick(self) -> None:
        self.count += 1
        self.numbers.publish(Int64(data=self.count))

    @timer(0.25)
    async def rest(self) -> None:
        await asyncio.sleep(0.001)
        self.log.info("rested\n", seconds=np.float64(0.001), at=Path(), why=OSError("tired"), also={"b": 1, "a": [2]})


class Echo(Node):
    echo = publisher(Int64, "echo")

    @subscription("numbers")
    def on_number(self, number: Int64) -> None:
        self.echo.publish(number)


class Slow(Node):
    """Handles one number in 250 ms, and lets one more wait."""

    @subscription("numbers", qos=QoS(depth=1))
    async def on_number(self, _number: Int64) -> None:
        await asyncio.sleep(0.25)


def traced(*what, seconds, also=None):
    lines = []

    @virtual_time
    async def main():
        lab = harness(*what)
        Trace(lab.graph, lines.append)
        if also is not None:
            also(lab)
        async with lab:
            await lab.advance(seconds)

    main()
    return "".join(lines)


def test_every_event_is_a_line(golden):
    golden(traced(Counter, Echo, Slow, seconds=0.3))


def test_every_request_and_reply_is_a_line(golden):
    class Asker(Node):
        reset = client(Trigger, "reset")

        @timer(0.1)
        async def ask(self) -> None:
            with contextlib.suppress(ServiceError):
                await self.reset.call()

    class Moody(Node):
        @service(Trigger, "reset")
        async def reset(self, _request: Trigger.Request) -> Trigger.Response:
            await asyncio.sleep(0.05)
            if self.clock.seconds() > 0.2:
                raise ValueError("enough")
            return Trigger.Response(success=True)

    golden(traced(Asker, Moody, seconds=0.25))


def test_what_is_pulled_is_a_delivery_too(golden):
    class Puller(Node):
        @timer(0.25)
        def look(self) -> None:
            assert self.numbers.latest is not None

        def declare(self) -> None:
            self.numbers = self.create_subscription(Int64, "numbers")

    golden(traced(Counter, Puller, seconds=0.25))


def test_a_parameter_that_changes_is_a_line(golden):
    class Gain(Parameters):
        gain: float = 1.0
        name: str = "left"

    class Amplifier(Node):
        parameters: Gain

    class Setter(Node):
        @timer(0.2)
        def set(self) -> None:
            self.graph.set_parameters(Amplifier, gain=2, name="a\nb")

    def give(lab):
        setter.graph = lab.graph

    setter = Setter()
    golden(traced(Amplifier, setter, seconds=0.5, also=give))


def test_extra_listeners_do_not_change_the_trace():
    plain = traced(Counter, Echo, Slow, seconds=2)

    class Taps(BusObserver):
        def __init__(self, bus):
            self.bus = bus

        def topic_added(self, topic):
            self.bus.tap(topic, str)

    def tap(lab):
        lab.graph.bus.observe(Taps(lab.graph.bus))

    assert traced(Counter, Echo, Slow, seconds=2, also=tap) == plain


# Hashes of content


def test_hashes_are_equal_only_for_equal_messages():
    messages = [
        Int64(data=1),
        Int64(data=2),
        Float64(data=1),
        Float64(data=math.nan),
        Float64(data=-0.0),
        Float64(data=0.0),
        String(data="1"),
        String(data="é"),
        Imu(),
        Imu(orientation_covariance=[1.0, *[0.0] * 8]),
        JointState(name=["ab", "c"]),
        JointState(name=["a", "bc"]),
        JointState(position=[1.0]),
        JointState(velocity=[1.0]),
    ]
    hashes = [content_hash(message) for message in messages]
    assert len(set(hashes)) == len(messages)
    assert hashes == [content_hash(message.replace()) for message in messages]


@given(st.lists(st.floats(width=64)), st.lists(st.text()))
def test_a_hash_depends_on_content_alone(position, name):
    one = JointState(name=name, position=position)
    other = JointState(name=tuple(name), position=np.array(position, float))
    assert content_hash(one) == content_hash(other)


def test_hashes_are_the_same_on_every_machine():
    """Traces are compared with those of other processes and of other days."""
    assert content_hash(Int64(data=1)) == "e46f4338de15fe52"
    assert content_hash(Imu()) == "c87abd37c2f12f33"
    assert content_hash(JointState(name=["a"], position=[0.5])) == "24d6acf0ae7b2ec8"


# The same bytes everywhere

LAB = """
import sys
from busflow.testing import harness, virtual_time
from busflow.testing.trace import Trace

@virtual_time
async def main():
    lab = harness("configs/lab1.yaml", seed=7)
    Trace(lab.graph, sys.stdout.write)
    async with lab:
        await lab.advance(20)

main()
"""


def lab_trace(python, hash_seed):
    environment = {"PYTHONHASHSEED": hash_seed, "PYTHONPATH": str(ROOT)}
    return subprocess.run([python, "-c", LAB], cwd=ROOT, env=environment, capture_output=True, check=True).stdout


@pytest.fixture(scope="module")
def trace():
    return lab_trace(sys.executable, "0")


@pytest.mark.long
def test_lab_trace_is_equal_in_every_process(trace):
    assert trace.count(b"\n") == 20 * 10 * 7 + 40 + 1
    assert hashlib.sha256(lab_trace(sys.executable, "1")).digest() == hashlib.sha256(trace).digest()


@pytest.mark.parametrize("python", [f"python3.{minor}" for minor in range(11, 15) if minor != sys.version_info.minor])
def test_lab_trace_is_equal_in_every_python(trace, python):
    found = shutil.which(python)
    needs = "import anyio, pydantic, numpy, yaml"
    if found is None or subprocess.run([found, "-c", needs], capture_output=True).returncode:
        pytest.skip(f"no {python} with what busflow needs")
    assert lab_trace(found, "0") == trace
