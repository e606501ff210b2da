"""What it costs to construct a message and to deliver it within a process, beside a bare call and an asyncio.Queue.

Run it with `python benchmarks/delivery.py`. Figures are CPU time of this thread per message, each the best of several
rounds, since other programs only ever make it slower; the second column is in bare calls, which tells more than
nanoseconds when it is read on another machine. Nothing is asserted.
"""

import asyncio
import sys
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import busflow
from busflow import Node, QoS, publisher, subscription
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.geometry_msgs import Quaternion, Vector3
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Header

ROUNDS = 15
BATCH = 10
"""How many messages are published before the loop has its turn: as many as a queue holds unless told."""
DEEP = QoS(depth=1000)
"""Deep enough for a machine that is busy with something else: nothing is dropped."""
BATCHES = 300
IMU = Imu()
HEADER = Header()
NAMES = [f"joint_{number}" for number in range(10)]
NUMBERS = [number / 7 for number in range(10)]


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


def nothing(_: object) -> None:
    pass


def nested_imu() -> Imu:
    """As a driver makes one for each reading."""
    return Imu(
        header=Header(stamp=Time(sec=1, nanosec=2), frame_id="imu_link"),
        orientation=Quaternion(x=0.0, y=0.0, z=0.0, w=1.0),
        angular_velocity=Vector3(x=0.1, y=0.2, z=0.3),
        linear_acceleration=Vector3(x=0.1, y=0.2, z=9.8),
    )


def joint_state() -> JointState:
    return JointState(header=HEADER, name=NAMES, position=NUMBERS, velocity=NUMBERS, effort=NUMBERS)


def per_call(work: Callable[[], object], times: int = 20_000) -> float:
    """Nanoseconds of CPU time that a call takes."""

    def once() -> float:
        began = time.thread_time_ns()
        for _ in range(times):
            work()
        return (time.thread_time_ns() - began) / times

    return min(once() for _ in range(ROUNDS))


async def per_message(batch: Callable[[], Awaitable[None]]) -> float:
    """Nanoseconds of CPU time that a message of a batch takes."""

    async def once() -> float:
        began = time.thread_time_ns()
        for _ in range(BATCHES):
            await batch()
        return (time.thread_time_ns() - began) / BATCHES / BATCH

    return min([await once() for _ in range(ROUNDS)])


async def delivered(sinks: int, kind: type[Node]) -> float:
    """What a message costs from `publish` to the end of the handlers."""
    source = Source()
    async with busflow.launch(source, *(kind(name=f"sink_{number}") for number in range(sinks))) as graph:

        async def batch() -> None:
            for _ in range(BATCH):
                source.imu.publish(IMU)
            await asyncio.sleep(0)

        cost = await per_message(batch)
        await asyncio.sleep(0.05)
        if any(line.dropped or line.queued for line in graph.bus.ledger()):
            raise SystemExit("messages were lost, the figures mean nothing: run it again on a quiet machine")
    return cost


async def queued() -> float:
    """What a message costs through an asyncio.Queue, from `put_nowait` to `get`."""
    queue: asyncio.Queue[Imu] = asyncio.Queue()

    async def take() -> None:
        while True:
            nothing(await queue.get())

    task = asyncio.create_task(take())

    async def batch() -> None:
        for _ in range(BATCH):
            queue.put_nowait(IMU)
        await asyncio.sleep(0)

    cost = await per_message(batch)
    task.cancel()
    return cost


def main() -> None:
    call = per_call(lambda: None, 200_000)

    def tell(what: str, cost: float) -> None:
        print(f"{what:52} {cost:8,.0f} ns {cost / call:7.1f} calls")

    tell("a bare call", call)
    print("constructing:")
    tell("  Vector3(x=…, y=…, z=…)", per_call(lambda: Vector3(x=1.0, y=2.0, z=3.0)))
    tell("  an Imu with all that is nested in it", per_call(nested_imu))
    tell("  a JointState of ten joints, from lists", per_call(joint_state))
    print(f"delivering, {BATCH} messages at a time:")
    tell("  an asyncio.Queue and a task", asyncio.run(queued()))
    tell("  one publisher to one handler", asyncio.run(delivered(1, Sink)))
    tell("  one publisher to one async handler", asyncio.run(delivered(1, AsyncSink)))
    tell("  one publisher to ten handlers", asyncio.run(delivered(10, Sink)))
    tell("  one publisher to ten async handlers", asyncio.run(delivered(10, AsyncSink)))


if __name__ == "__main__":
    main()
