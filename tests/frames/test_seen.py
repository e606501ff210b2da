"""`SeenFrames`: what an onlooker keeps of the transforms that it sees, and every mistake with its nodes."""

from __future__ import annotations

from busflow import Time
from busflow.frames.seen import SeenFrames
from busflow.msgs.geometry_msgs import Quaternion, Transform, TransformStamped
from busflow.msgs.std_msgs import Header
from busflow.msgs.tf2_msgs import TFMessage

S = 1_000_000_000
ZERO = "its quaternion (0, 0, 0, 0) has the length 0, not 1: no rotation is (0, 0, 0, 1)"


def message(parent, child, second=0.0, w=1.0):
    header = Header(stamp=Time(seconds=second).to_msg(), frame_id=parent)
    edge = TransformStamped(header=header, child_frame_id=child, transform=Transform(rotation=Quaternion(w=w)))
    return TFMessage(transforms=(edge,))


def test_account_has_publishers_counts_and_delays():
    seen = SeenFrames()
    for second in range(1, 5):
        seen.add(message("/odom", "base", second), ("/wheels",), second * S + second * 1000, fixed=False)
    seen.add(message("base", "imu"), (), 0, fixed=True)
    base, imu = seen.edges["base"], seen.edges["imu"]
    assert (base.by, base.count, base.delay_ns, base.longest_ns) == ("/wheels", 4, 10_000, 4000)
    assert (imu.by, imu.count) == ("", 1)
    assert seen.problems() == []


def test_every_mistake_names_its_nodes(golden):
    seen = SeenFrames()
    seen.add(message("odom", "base", 20), ("/wheels",), 0, fixed=False)
    seen.add(message("odom", "base", 20.1), ("/slam",), 0, fixed=False)
    seen.add(message("odom", "arm", w=0.0), (), 0, fixed=False)
    for parent in ("map", "world"):
        seen.add(message(parent, "goal"), (), 0, fixed=True)
    seen.add(message("odom", "base", 2), ("/wheels",), 0, fixed=False)
    golden("\n".join(f"{each.code}: {each.render()}" for each in seen.problems()))


def test_one_of_several_publishers_is_no_finding():
    """A recording knows the publishers of a topic, and not which of them published a message."""
    seen = SeenFrames()
    seen.add(message("odom", "base", 20), ("/wheels", "/slam"), 0, fixed=False)
    seen.add(message("odom", "arm", w=0.0), ("/wheels", "/slam"), 0, fixed=False)
    assert (seen.edges["base"].by, seen.edges["base"].one_of) == ("one of /wheels, /slam", True)
    (problem,) = seen.problems()
    assert problem.code == "invalid-transform"
    assert problem.message.startswith("one of /wheels, /slam ")
