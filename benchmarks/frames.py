"""What frames cost: `python benchmarks/frames.py` prints microseconds of CPU time, the best of several rounds.

`take` is a whole TransformStamped into the tree, `lookup` the answer as a message over six hops that all move, at a
time between two stamps, which is interpolated at each hop. `joint states` is what a message with the 31 joints of the
humanoid costs from its publication on, until the transforms of all links are published and in the tree; at 100 Hz,
100 µs are 1 % of a core.
"""

from __future__ import annotations

import math
import sys
import timeit
from collections.abc import Callable
from itertools import count, pairwise
from pathlib import Path
from time import process_time

from busflow import Node, transforms
from busflow.bus.bus import Bus
from busflow.clock import NS_PER_S
from busflow.description.robot import MOVES
from busflow.description.robot_state_publisher import RobotStatePublisher
from busflow.frames.declarations import Frames
from busflow.frames.shared import SharedFrames
from busflow.msgs.builtin_interfaces import Time
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped, Vector3
from busflow.msgs.sensor_msgs import JointState
from busflow.msgs.std_msgs import Header
from busflow.msgs.tf2_msgs import TFMessage
from busflow.testing import harness, virtual_time

CHAIN = ("map", "odom", "base_link", "torso", "shoulder", "elbow", "hand")
QUICK = "--quick" in sys.argv
"""One short round: to see that everything works."""
ROUNDS, CALLS = (1, 50) if QUICK else (7, 5000)
HUMANOID = Path(__file__).parents[1] / "configs/humanoid/humanoid.urdf"
STATES = 2 if QUICK else 200


class Asks(Node):
    frames = transforms()


def message(parent: str, child: str, stamp_ns: int) -> TFMessage:
    sec, nanosec = divmod(stamp_ns, NS_PER_S)
    half = stamp_ns / NS_PER_S / 2
    rotation = Quaternion(z=math.sin(half), w=math.cos(half))
    return TFMessage(
        transforms=(
            TransformStamped(
                header=Header(stamp=Time(sec=sec, nanosec=nanosec), frame_id=parent),
                child_frame_id=child,
                transform=Transform(translation=Vector3(x=1.0, y=2.0), rotation=rotation),
            ),
        )
    )


def best_us(call: Callable[[], object]) -> float:
    return min(timeit.repeat(call, number=CALLS, repeat=ROUNDS, timer=process_time)) / CALLS * 1e6


def take_us(bus: Bus) -> float:
    (shared,) = (each for each in bus.shared.values() if isinstance(each, SharedFrames))
    stamps = count(NS_PER_S, 10_000_000)
    made = iter([message("world", "moving", next(stamps)) for _ in range(CALLS * ROUNDS)])
    return best_us(lambda: shared.take(next(made)))


def lookup_us(frames: Frames) -> dict[str, float]:
    async def between() -> None:
        await frames.lookup("map", "hand", at=Time(sec=1, nanosec=5_000_000))

    def interpolated() -> None:
        try:
            between().send(None)
        except StopIteration:
            return
        raise AssertionError("the lookup waited")

    return {
        "lookup, 6 hops, between stamps": best_us(interpolated),
        "latest, 6 hops": best_us(lambda: frames.latest("map", "hand")),
    }


@virtual_time
async def figures() -> dict[str, float]:
    async with harness(Asks) as lab:
        for tick in range(200):
            for parent, child in pairwise(CHAIN):
                lab.publish("/tf", message(parent, child, NS_PER_S + tick * 10_000_000))
            await lab.settle()
        found = lookup_us(lab.node(Asks).frames)
        return {"take, 1 transform": take_us(lab.graph.bus), **found}


@virtual_time
async def states_us() -> float:
    """CPU time of a message with all joints, in a graph with a node that asks for frames."""
    async with harness(RobotStatePublisher(description=str(HUMANOID)), Asks, keep=1) as lab:
        names = [each.name for each in lab.node(RobotStatePublisher).robot.joints if each.kind in MOVES]
        out = lab.advertise(JointState, "joint_states")
        stamps = (Time(sec=each // 100, nanosec=each % 100 * 10_000_000) for each in count(100))
        best = math.inf
        for _ in range(ROUNDS):
            made = [
                JointState(header=Header(stamp=next(stamps)), name=names, position=[0.1 + each / STATES] * len(names))
                for each in range(STATES)
            ]
            began = process_time()
            for each in made:
                out.publish(each)
                await lab.settle()
            best = min(best, process_time() - began)
        if len(lab.node(Asks).frames.names) <= len(names):
            raise AssertionError("the tree does not have all links")
        return best / STATES * 1e6


if __name__ == "__main__":
    for name, cost_us in (figures() | {"joint states, 31 joints": states_us()}).items():
        print(f"{name:<32}{cost_us:8.2f} µs")
