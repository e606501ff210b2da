"""What it costs to construct a message and to deliver it within a process, beside a bare call and an asyncio.Queue.

Run it with `python benchmarks/delivery.py`. Contenders take turns, see `figures`; a message's cost is that from its
publish to the end of the handlers, the turn of the event loop included, in bursts of 64 unless said. Nothing is
asserted, but that no message was lost.
"""

import asyncio
import sys
from collections.abc import Callable, Coroutine
from contextlib import AsyncExitStack
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import busflow
from benchmarks.figures import QUICK, Contender, Figure, measure, nothing
from busflow import Node, QoS, publisher, subscription
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Header
from busflow.runner.loops.system import new_event_loop

BURST = 64
"""Messages that are published before the loop has its turn."""
DEEP = QoS(depth=1000)
"""Deep enough for a machine that is busy with something else: nothing is dropped."""
IMU = Imu()
HEADER = Header()
NAMES = [f"joint_{number}" for number in range(10)]
NUMBERS = [number / 7 for number in range(10)]
IMU_FIELDS: dict[str, Any] = {
    "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "imu_link"},
    "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    "angular_velocity": {"x": 0.1, "y": 0.2, "z": 0.3},
    "linear_acceleration": {"x": 0.1, "y": 0.2, "z": 9.8},
}


class Source(Node):
    imu = publisher(Imu, "imu/data")


class Sink(Node):
    @subscription("imu/data", qos=DEEP)
    def on_imu(self, _imu: Imu) -> None:
        pass


class AsyncSink(Node):
    @subscription("imu/data", qos=DEEP)
    async def on_imu(self, _imu: Imu) -> None:
        pass


class Link(Node):
    """One of a chain: what it receives it publishes."""

    def declare(self) -> None:
        number = int(self.name.removeprefix("link_"))
        self.out = self.create_publisher(Imu, f"imu/after_{number}")
        topic = "imu/data" if number == 1 else f"imu/after_{number - 1}"
        self.create_subscription(Imu, topic, self.pass_on, qos=DEEP)

    def pass_on(self, imu: Imu) -> None:
        self.out.publish(imu)


class Bystander(Node):
    """Has a topic of its own, on which nothing happens."""

    def declare(self) -> None:
        self.create_publisher(Imu, f"own/{self.name}")
        self.create_subscription(Imu, f"own/{self.name}", nothing)


def nested_imu() -> Imu:
    """As a driver makes one for each reading."""
    return Imu(
        header=Header(stamp=Time(sec=1, nanosec=2), frame_id="imu_link"),
        orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
        angular_velocity=Vector3(x=0.1, y=0.2, z=0.3),
        linear_acceleration=Vector3(x=0.1, y=0.2, z=9.8),
    )


def imu_of_dicts() -> Imu:
    """As one makes it of what was read from a file."""
    return Imu(**IMU_FIELDS)


def joint_state() -> JointState:
    return JointState(header=HEADER, name=NAMES, position=NUMBERS, velocity=NUMBERS, effort=NUMBERS)


def constructed(name: str, work: Callable[[], object], times: int = 20) -> Contender:
    """What making a message costs."""

    async def batch() -> None:
        for _ in range(times):
            work()

    return Contender(name, batch, times)


async def delivered(stack: AsyncExitStack, name: str, *sinks: Node, sources: int = 1, burst: int = BURST) -> Contender:
    """What a message costs on its way to these nodes, of so many publishers in turn."""
    nodes = [Source(name=f"source_{number}") for number in range(sources)]
    graph = await stack.enter_async_context(busflow.launch(*nodes, *sinks))
    publishes = [node.imu.publish for node in nodes]

    async def batch() -> None:
        if sources == 1:
            imu = nodes[0].imu
            for _ in range(burst):
                imu.publish(IMU)
        else:
            for number in range(burst):
                publishes[number % sources](IMU)
        await asyncio.sleep(0)

    stack.push_async_callback(_refuse_losses, graph)
    return Contender(name, batch, burst)


async def _refuse_losses(graph: busflow.Graph) -> None:
    await asyncio.sleep(0.05)
    if not QUICK and any(line.dropped or line.queued for line in graph.bus.ledger()):  # quick figures never mean much
        raise SystemExit("messages were lost, the figures mean nothing: run it again on a quiet machine")


def queued(stack: AsyncExitStack, name: str, takers: int = 1, burst: int = BURST) -> Contender:
    """What a message costs through an asyncio.Queue for each taker, from `put_nowait` to the end of a call."""
    queues = [asyncio.Queue[Imu]() for _ in range(takers)]

    async def take(queue: asyncio.Queue[Imu]) -> None:
        while True:
            nothing(await queue.get())

    for queue in queues:
        stack.callback(asyncio.create_task(take(queue)).cancel)

    async def batch() -> None:
        for _ in range(burst):
            for queue in queues:
                queue.put_nowait(IMU)
        await asyncio.sleep(0)

    return Contender(name, batch, burst)


async def construction_figures() -> list[Figure]:
    """What messages cost that are made."""
    return await measure(
        [
            constructed("Vector3(x=…, y=…, z=…)", lambda: Vector3(x=1.0, y=2.0, z=3.0)),
            constructed("an Imu with all that is nested in it", nested_imu),
            constructed("an Imu of nested dicts", imu_of_dicts),
            constructed("a JointState of ten joints, from lists", joint_state),
        ]
    )


def _sinks(kind: type[Node], count: int) -> list[Node]:
    return [kind(name=f"sink_{number}") for number in range(count)]


async def delivery_figures() -> list[Figure]:
    """What messages cost on their way."""
    async with AsyncExitStack() as stack:
        chain = [Link(name=f"link_{number}") for number in range(1, 6)]
        crowd = [Bystander(name=f"bystander_{number}") for number in range(1000)]
        return await measure(
            [
                queued(stack, "an asyncio.Queue and a task"),
                await delivered(stack, "one publisher to one handler", Sink()),
                await delivered(stack, "the same, one message at a time", Sink(), burst=1),
                await delivered(stack, "the same, ten messages at a time", Sink(), burst=10),
                await delivered(stack, "the same, among 1,000 other nodes and topics", Sink(), *crowd),
                await delivered(stack, "one publisher to one async handler", AsyncSink()),
                await delivered(stack, "ten publishers to one handler", Sink(), sources=10),
                await delivered(stack, "a chain of five nodes, all together", *chain),
                queued(stack, "ten asyncio.Queues and tasks, all together", 10),
                await delivered(stack, "one publisher to ten handlers, all together", *_sinks(Sink, 10)),
                await delivered(stack, "one publisher to ten async handlers, all together", *_sinks(AsyncSink, 10)),
                await delivered(
                    stack, "one publisher to a hundred handlers, eight at a time", *_sinks(Sink, 100), burst=8
                ),
            ]
        )


def figures() -> dict[str, list[Figure]]:
    """All of them, each measured beside those of its group."""
    groups: dict[str, Callable[[], Coroutine[None, None, list[Figure]]]] = {
        "constructing": construction_figures,
        f"delivering, in bursts of {BURST}": delivery_figures,
    }
    found: dict[str, list[Figure]] = {}
    with asyncio.Runner(loop_factory=new_event_loop) as runner:
        for name, group in groups.items():
            found[name] = runner.run(group())
    return found


def main() -> None:
    for name, group in figures().items():
        print(f"{name}:")
        for figure in group:
            print(f"  {figure}")


if __name__ == "__main__":
    main()
