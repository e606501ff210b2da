"""How fast virtual time goes, and how many orders of events a test sees in a second.

Run it with `python benchmarks/virtual_time.py`. Figures are per second of CPU time of this thread; each is the best of
several rounds, since other programs only ever make it slower. Nothing is asserted.
"""

import asyncio
import sys
import time
from collections.abc import Callable, Coroutine
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from busflow import Node, publisher, subscription, timer
from busflow.launchfile.load.load import load
from busflow.msgs.sensor_msgs import Imu, JointState
from busflow.msgs.std_msgs import Float64
from busflow.testing import explore, harness, virtual_time
from busflow.testing.expectations import Trials
from plugins.sensor_processor import SensorProcessor
from plugins.sensor_publisher import SensorPublisher

LAB = Path(__file__).parents[1] / "configs/lab1.yaml"
IMU, JOINTS, NUMBER = Imu(), JointState(), Float64()
QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
ROUNDS = 1 if QUICK else 7
OF_ALL = 0.02 if QUICK else 1.0
"""How much of the work is done."""


class Source(Node):
    """The lab's publisher, with messages that are made already."""

    imu = publisher(Imu, "imu/data")
    joint_states = publisher(JointState, "joint_states")

    @timer(0.1)
    def tick(self) -> None:
        self.imu.publish(IMU)
        self.joint_states.publish(JOINTS)


class Processor(Node):
    """The lab's processor, with messages that are made already."""

    balance = publisher(Float64, "balance_state")
    stability = publisher(Float64, "stability_index")

    @subscription("imu/data")
    def on_imu(self, _imu: Imu) -> None:
        self.balance.publish(NUMBER)
        self.stability.publish(NUMBER)

    @subscription("joint_states")
    def on_joints(self, _joints: JointState) -> None:
        pass

    @timer(0.5)
    def tell_status(self) -> None:
        pass


class AsyncProcessor(Processor):
    """The same, each handler a coroutine."""

    @subscription("imu/data")
    async def on_imu(self, _imu: Imu) -> None:
        self.balance.publish(NUMBER)
        self.stability.publish(NUMBER)

    @subscription("joint_states")
    async def on_joints(self, _joints: JointState) -> None:
        pass


class Listener(Node):
    @subscription("imu/data")
    def on_imu(self, _imu: Imu) -> None:
        pass


def best(work: Callable[[], float]) -> float:
    """The most that a round got done in a second of CPU time."""
    return max(_rate(work) for _ in range(ROUNDS))


def _rate(work: Callable[[], float]) -> float:
    began = time.thread_time()
    done = work()
    return done / (time.thread_time() - began)


def simulated(*what: Path | type[Node], seconds: float) -> float:
    """Simulated seconds per second of CPU time, without the start and the stop."""
    seconds *= OF_ALL

    @virtual_time
    async def main() -> float:
        async with harness(*what, seed=1) as lab:
            began = time.thread_time()
            await lab.advance(seconds)
            return seconds / (time.thread_time() - began)

    return max(main() for _ in range(ROUNDS))


def sleeping() -> float:
    """Turns of the loop in which one task sleeps."""

    @virtual_time
    async def main() -> float:
        times = round(20_000 * OF_ALL)
        for _ in range(times):
            await asyncio.sleep(0.1)
        return float(times)

    return main()


def exploring(test: Callable[[], Coroutine[None, None, None]], schedules: int) -> float:
    explore(schedules=schedules)(test)()
    return float(schedules)


async def three_nodes() -> None:
    async with harness(Source, Listener(name="left"), Listener(name="right")) as lab:
        await lab.advance(0.5)


def seeds() -> float:
    trials = Trials(load(LAB), 1.0)
    count = round(50 * OF_ALL)
    trials.run(range(count))
    return float(count)


def calls() -> float:
    def nothing(_: object) -> None:
        pass

    times = round(1_000_000 * OF_ALL)
    for _ in range(times):
        nothing(None)
    return float(times)


def tell(what: str, figure: float, unit: str = "") -> None:
    print(f"{what:52} {figure:10,.0f} {unit}".rstrip())


def main() -> None:
    tell("a bare call, for comparison", 1e9 / best(calls), "ns")
    tell("sleeps of one task", best(sleeping), "per CPU s")
    print("simulated seconds per CPU second:")
    tell("  the lab, as configs/lab1.yaml starts it", simulated(LAB, seconds=200))
    tell("  its two classes, with their defaults", simulated(SensorPublisher, SensorProcessor, seconds=200))
    tell("  the same graph, its messages made beforehand", simulated(Source, Processor, seconds=600))
    tell("  the same, with async handlers", simulated(Source, AsyncProcessor, seconds=600))
    tell(
        "explorations of a graph of three nodes, five ticks",
        best(lambda: exploring(three_nodes, round(100 * OF_ALL))),
        "per CPU s",
    )
    tell("runs of the lab for one second, each with a seed", best(seeds), "per CPU s")


if __name__ == "__main__":
    main()
