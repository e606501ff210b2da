"""What nodes say about frames: `declarations.py` and `shared.py`. `edge.py` and `rigid.py` are tested with the tree."""

from __future__ import annotations

import asyncio
import re

import pytest

from busflow import (
    TRANSIENT_LOCAL,
    Duration,
    FramesNotConnected,
    Graph,
    InvalidTransform,
    Node,
    Time,
    TransformNotThere,
    TransformTooOld,
    UnknownFrame,
    timer,
    transforms,
)
from busflow.clock import SIM_EPOCH_NS, SimClock
from busflow.errors import NotRunning
from busflow.frames.shared import SharedFrames, shared_frames
from busflow.msgs.geometry_msgs import Point, PointStamped, Quaternion, Transform, TransformStamped, Vector3
from busflow.msgs.std_msgs import Header
from busflow.msgs.tf2_msgs import TFMessage
from busflow.testing import explore, harness, virtual_time


def transform(parent, child, stamp, x=0.0, **rotation):
    return TransformStamped(
        header=Header(stamp=stamp.to_msg(), frame_id=parent),
        child_frame_id=child,
        transform=Transform(translation=Vector3(x=x), rotation=Quaternion(**rotation or {"w": 1.0})),
    )


class Odometry(Node):
    """Sends odom → base_link at 10 Hz; x is the number of the tick."""

    frames = transforms()

    async def start(self) -> None:
        self.count = 0

    @timer(0.1)
    def tick(self) -> None:
        self.count += 1
        self.frames.send(transform("odom", "base_link", self.clock.now(), float(self.count)))


class Camera(Node):
    """Fixed to the base."""

    frames = transforms()

    async def start(self) -> None:
        self.frames.send_static(transform("base_link", "camera", Time(), 0.5))


class User(Node):
    frames = transforms()


@virtual_time
async def test_lookup_waits_exactly_until_edge_is_there():
    async with harness(Odometry, User) as lab:
        frames, clock = lab.node(User).frames, lab.graph.clock
        await lab.advance(0.25)
        wanted = clock.now()
        asked = asyncio.ensure_future(frames.lookup("odom", "base_link", at=wanted, timeout=1))
        await lab.advance(0.049)
        assert not asked.done()
        await lab.advance(0.001)
        found = asked.result()
    assert found.transform.translation.x == pytest.approx(2.5)
    assert (found.header.frame_id, found.child_frame_id) == ("odom", "base_link")
    assert found.header.stamp == wanted.to_msg()


@virtual_time
async def test_lookup_ends_exactly_at_its_timeout(golden):
    async with harness(Odometry, User) as lab:
        user, clock = lab.node(User), lab.graph.clock
        await lab.advance(1)
        with golden.raises(TransformNotThere):
            await lookup_in(user, clock.now() + Duration(seconds=1), timeout_s=0.3, lab=lab)
        assert clock.seconds() == pytest.approx(1.3)


async def lookup_in(user, at, *, timeout_s, lab, frames=("odom", "base_link")):
    """Look up beside the advancing time, and return at the moment of the answer."""
    asked = asyncio.ensure_future(user.frames.lookup(*frames, at=at, timeout=timeout_s))
    while not asked.done():
        await lab.advance(0.05)
    return await asked


@virtual_time
async def test_hopeless_lookup_fails_at_once():
    async with harness(Odometry, User) as lab:
        await lab.advance(20)
        before = lab.graph.clock.seconds()
        with pytest.raises(TransformTooOld, match=r" 9\.800 s "):
            await lab.node(User).frames.lookup("odom", "base_link", at=Time(SIM_EPOCH_NS + 200_000_000), timeout=5)
        assert lab.graph.clock.seconds() == before


@virtual_time
async def test_lookup_waits_for_a_frame_not_known_yet():
    class Late(Node):
        frames = transforms()

        @timer(0.4)
        def tick(self) -> None:
            self.frames.send_static(transform("base_link", "lidar", self.clock.now(), 2.0))

    async with harness(Odometry, Late, User) as lab:
        await lab.advance(0.2)
        at = lab.graph.clock.now()
        found = await lookup_in(lab.node(User), at, timeout_s=1, lab=lab, frames=("odom", "lidar"))
        assert found.transform.translation.x == pytest.approx(4)
        assert lab.graph.clock.seconds() == pytest.approx(0.4, abs=0.05)


@virtual_time
async def test_lookup_without_answer_says_what_is_unknown(golden):
    async with harness(Odometry, Camera, User) as lab:
        await lab.advance(0.2)
        user, now = lab.node(User), lab.graph.clock.now()
        with golden.raises(UnknownFrame):
            await lookup_in(user, now, timeout_s=0.1, lab=lab, frames=("odom", "camra"))
        fixed = lab.advertise(TFMessage, "/tf_static", qos=TRANSIENT_LOCAL)
        fixed.publish(TFMessage(transforms=(transform("map", "goal", Time()),)))
        await lab.settle()
        with golden.raises(FramesNotConnected):
            user.frames.latest("map", "camera")


@virtual_time
async def test_latest_and_apply_use_the_whole_path():
    async with harness(Odometry, Camera, User) as lab:
        await lab.advance(0.3)
        frames = lab.node(User).frames
        assert frames.names == {"odom", "base_link", "camera"}
        assert frames.latest("odom", "camera").transform.translation.x == pytest.approx(3.5)
        seen = PointStamped(header=Header(frame_id="camera"), point=Point(x=1.0, y=2.0))
        assert frames.apply(seen, "odom").point == Point(x=4.5, y=2.0)
        at_two = Header(frame_id="camera", stamp=Time(SIM_EPOCH_NS + 250_000_000).to_msg())
        moved = frames.apply(seen.replace(header=at_two), "odom")
        assert (moved.point.x, moved.header) == (pytest.approx(4.0), at_two.replace(frame_id="odom"))


@virtual_time
async def test_one_tree_serves_all_nodes_of_a_process():
    async with harness(Odometry, Camera, User) as lab:
        await lab.advance(0.3)
        (shared,) = (each for each in lab.graph.bus.shared.values() if isinstance(each, SharedFrames))
        assert shared.tree.edges["base_link"].count == 3
        assert lab.ledger.dropped == 0
        assert {line.node for line in lab.ledger if line.topic == "/tf"} == {"/odometry", "/camera", "/user"}


@virtual_time
async def test_remapped_nodes_have_a_tree_of_their_own(tmp_path):
    plugin = tmp_path / "left.py"
    plugin.write_text("from tests.frames.test_frames import Odometry\n\n\nclass Left(Odometry):\n    pass\n")
    file = tmp_path / "lab.yaml"
    names = "{/tf: /left/tf, /tf_static: /left/tf_static}"
    file.write_text(f"plugins: [.]\nnodes:\n  left: {{plugin: left, remap: {names}}}\n  right: {{plugin: left}}\n")
    async with harness(file) as lab:
        await lab.advance(0.3)
        assert [each.tree.edges["base_link"].count for each in lab.graph.bus.shared.values()] == [3, 3]
        assert [line.topic for line in lab.ledger if line.published] == ["/left/tf", "/tf"]


@virtual_time
async def test_restarted_node_keeps_tree_and_sends_on():
    async with harness(Odometry, User) as lab:
        await lab.advance(0.35)
        supervisor = next(each for each in lab.graph.supervisors if each.name == "/odometry")
        await lab.graph.course.stop_by_hand([supervisor])
        await lab.graph.course.start_by_hand(supervisor)
        await lab.advance(0.25)
        tree = next(iter(lab.graph.bus.shared.values())).tree
        assert tree.edges["base_link"].count == 5
        assert lab.node("user").frames.latest("odom", "base_link").transform.translation.x == 2


# Sending.


@virtual_time
async def test_refused_transform_is_the_senders_error(golden):
    class Broken(Node):
        frames = transforms()

    async with harness(Odometry, Camera, Broken) as lab:
        await lab.advance(0.1)
        send, now = lab.node(Broken).frames.send, lab.graph.clock.now()
        with golden.raises(InvalidTransform):
            send(transform("map", "base_link", now))
        with golden.raises(InvalidTransform):
            send(transform("camera", "odom", now))
        with golden.raises(InvalidTransform):
            send(transform("camera", "lens", now, w=0.0))
        with golden.raises(InvalidTransform):
            lab.node(Broken).frames.send_static(transform("camera", "lens", now, float("nan")))
        assert "lens" not in lab.node(Broken).frames.names


@virtual_time
async def test_two_senders_of_one_edge_are_named_once():
    class Second(Odometry):
        pass

    async with harness(Odometry, Second) as lab:
        await lab.advance(1)
        (line,) = (each.event for each in lab.log if each.level == "warning")
        assert re.search("/odometry .*/second .*odom → base_link", line)


@virtual_time
async def test_parent_may_change_once_its_sender_has_left():
    class Second(Node):
        frames = transforms()

    async with harness(Odometry, Second) as lab:
        await lab.advance(0.2)
        await lab.graph.course.dismiss(["/odometry"])
        lab.node(Second).frames.send(transform("map", "base_link", lab.graph.clock.now(), 7.0))
        assert lab.node(Second).frames.latest("map", "base_link").transform.translation.x == 7


@virtual_time
async def test_foreign_nonsense_is_left_out_and_logged_once(golden):
    async with harness(Odometry, User) as lab:
        await lab.advance(0.1)
        now, fixed = lab.graph.clock.now(), lab.advertise(TFMessage, "/tf_static", qos=TRANSIENT_LOCAL)
        for _ in range(3):
            lab.publish("/tf", TFMessage(transforms=(transform("odom", "bad", now, w=3.0), transform("a", "b", now))))
            fixed.publish(TFMessage(transforms=(transform("odom", "odom", now),)))
        await lab.settle()
        golden("\n".join(each.event for each in lab.log if each.level == "warning"))
        shared = next(iter(lab.graph.bus.shared.values()))
        assert (shared.refused, lab.node(User).frames.names) == (6, {"odom", "base_link", "a", "b"})


@virtual_time
async def test_looping_bag_empties_the_tree_and_says_so(golden):
    async with harness(User) as lab:
        for _ in range(3):
            for second in (100, 110):
                lab.publish("/tf", TFMessage(transforms=(transform("odom", "base_link", Time(seconds=second)),)))
        lab.publish("/tf", TFMessage(transforms=(transform("map", "base_link", Time(seconds=111)),)))
        await lab.settle()
        golden("\n".join(each.event for each in lab.log if each.level == "warning"))
        assert next(iter(lab.graph.bus.shared.values())).tree.set_back == 2


@virtual_time
async def test_late_node_gets_all_static_frames():
    async with harness(Camera) as lab:
        lab.node(Camera).frames.send_static(transform("base_link", "imu", Time(), 0.1))
        late = lab.graph.subscribe(TFMessage, "/tf_static", qos=TRANSIENT_LOCAL)
        await lab.settle()
        kept = late.latest
        assert kept is not None
        assert [each.child_frame_id for each in kept.transforms] == ["camera", "imu"]


@virtual_time
async def test_tree_begins_with_what_publishers_keep():
    async with harness(User) as lab:
        for topic, edge in (("/late/tf", ("odom", "base")), ("/late/tf_static", ("base", "imu"))):
            publisher = lab.advertise(TFMessage, topic, qos=TRANSIENT_LOCAL)
            publisher.publish(TFMessage(transforms=(transform(*edge, Time(seconds=1)),)))
        graph = lab.graph
        shared = shared_frames(graph.bus, "/late/tf", "/late/tf_static", graph.log.bind("busflow"))
        assert shared.tree.frames == {"odom", "base", "imu"}


def test_frames_of_a_node_without_graph_say_so():
    with pytest.raises(AttributeError, match=r"^User\.frames "):
        _ = User().frames


@virtual_time
async def test_frames_before_the_connection_say_so(golden):
    class Early(Node):
        frames = transforms()

        def declare(self) -> None:
            golden(repr(self.frames))
            with golden.raises(NotRunning):
                self.frames.latest("a", "b")

    async with Graph([Early], clock=SimClock()) as graph:
        assert repr(graph.node(Early).frames) == "<Frames of /early: 0 edges>"


@explore(schedules=60)
async def test_no_lookup_depends_on_the_order_of_arrival():
    class Asks(Node):
        frames = transforms()

        async def run(self) -> None:
            await self.clock.sleep(0.25)
            found = await self.frames.lookup("odom", "camera", at=self.clock.now())
            assert found.transform.translation.x == pytest.approx(3.0)

    async with harness(Odometry, Camera, Asks) as lab:
        await lab.advance(0.5)
