"""`@synchronized` (`declarations.py`, `group.py`, `members.py`)."""

from __future__ import annotations

import pytest

from busflow import Graph, Node, QoS, Time, Unpaired, on_event, publisher, supervised, synchronized, timer
from busflow.clock import SIM_EPOCH_NS
from busflow.errors import InvalidDeclaration, NodeFailed
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.msgs.std_msgs import Float64, Header
from busflow.testing import explore, harness, virtual_time
from busflow.wire.client.checkup import findings
from busflow.wire.client.graph_view import view

S = 1_000_000_000


def image(ms):
    return Image(header=Header(stamp=Time(SIM_EPOCH_NS + ms * 1_000_000).to_msg()))


def ms(message):
    return round((message.header.stamp.sec * S + message.header.stamp.nanosec - SIM_EPOCH_NS) / 1e6)


class Stereo(Node):
    """Keeps the pairs that it gets, and what found no partner."""

    async def start(self) -> None:
        self.pairs: list[tuple[int, ...]] = []
        self.alone: list[tuple[str, int, float | None]] = []

    @synchronized("left/image", "right/image", within="20ms", depth=3)
    def on_pair(self, left: Image, right: Image) -> None:
        self.pairs.append((ms(left), ms(right)))

    @on_event("left/image")
    def on_left_alone(self, event: Unpaired) -> None:
        self.alone.append((event.topic, ms(event.message), event.nearest_s))


class StereoInTask(Stereo):
    @synchronized("left/image", "right/image", within="20ms", depth=3)
    async def on_pair(self, left: Image, right: Image) -> None:
        await self.clock.sleep(0.001)
        self.pairs.append((ms(left), ms(right)))


def send(lab, topic, *times):
    for each in times:
        lab.publish(topic, image(each))


@pytest.mark.parametrize("kind", [Stereo, StereoInTask])
def test_pairs_reach_the_handler_once_and_in_order(kind):
    @virtual_time
    async def run():
        async with harness(kind) as lab:
            send(lab, "/left/image", 0, 100)
            send(lab, "/right/image", 8, 95)
            await lab.advance(0.01)
            send(lab, "/left/image", 200)
            send(lab, "/right/image", 201)
            await lab.advance(0.01)
            assert lab.node(kind).pairs == [(0, 8), (100, 95), (200, 201)]
            assert [(line.delivered, line.dropped, line.queued) for line in lab.ledger] == [(3, 0, 0)] * 2

    run()


@virtual_time
async def test_message_alone_is_a_drop_and_an_event(golden):
    async with harness(Stereo) as lab:
        send(lab, "/left/image", 0, 100)
        send(lab, "/right/image", 31, 101)
        await lab.advance(0.01)
        send(lab, "/left/image", 200)
        send(lab, "/right/image", 201)
        await lab.advance(0.01)
        node = lab.node(Stereo)
        assert node.pairs == [(100, 101), (200, 201)]
        assert node.alone == [("/left/image", 0, 0.031)]
        assert [line.drops for line in lab.ledger] == [{"unpaired": 1}, {"unpaired": 1}]
        left, right = (one for each in lab.graph.supervisors for one in each.runtime.endpoints.subscriptions)
        golden(f"{left.remark}\n{right.remark}")


@virtual_time
async def test_silent_partner_lets_the_oldest_go(golden):
    async with harness(Stereo) as lab:
        send(lab, "/left/image", *range(0, 500, 100))
        await lab.advance(0.01)
        assert lab.node(Stereo).alone == [("/left/image", 0, None), ("/left/image", 100, None)]
        left = next(line for line in lab.ledger if line.published)
        assert (left.published, left.delivered, left.drops, left.queued) == (5, 0, {"unpaired": 2}, 3)
        (planned, _) = (one for each in lab.graph.supervisors for one in each.runtime.endpoints.subscriptions)
        golden(planned.remark)


STEREO = """\
from busflow import Node, synchronized
from busflow.msgs.sensor_msgs import Image


class Stereo(Node):
    @synchronized("left/image", "right/image", within="20ms", depth=3)
    def on_pair(self, left: Image, right: Image) -> None:
        pass
"""


@virtual_time
async def test_a_launch_file_states_another_depth(tmp_path):
    (tmp_path / "stereo.py").write_text(STEREO)
    file = tmp_path / "lab.yaml"
    file.write_text("plugins: [.]\nnodes:\n  stereo: {plugin: stereo, subscriptions: {left/image: {depth: 5}}}\n")
    async with harness(file) as lab:
        send(lab, "/left/image", *range(0, 700, 100))
        await lab.advance(0.01)
        (left,) = (line for line in lab.ledger if line.published)
        assert (left.queued, left.drops) == (5, {"unpaired": 2})


@virtual_time
async def test_restart_keeps_what_waits():
    async with harness(supervised(Stereo, restart="on-failure")) as lab:
        send(lab, "/left/image", 100)
        await lab.settle()
        lab.fail(Stereo, ValueError("once"))
        send(lab, "/right/image", 100)
        await lab.advance(5)
        assert lab.node(Stereo).pairs == [(100, 100)]
        assert lab.ledger.dropped == 0


@virtual_time
async def test_trigger_gets_the_newest_held_message(golden):
    class Controller(Node):
        async def start(self) -> None:
            self.got: list[tuple[int, int]] = []

        @synchronized("imu/data", hold="joint_states")
        def on_imu(self, imu: Imu, joints: JointState) -> None:
            self.got.append((ms(imu), ms(joints)))

    async with harness(Controller) as lab:

        def stamped(kind, time):
            return kind(header=image(time).header)

        lab.publish("/imu/data", stamped(Imu, 0))
        await lab.settle()
        for time in (5, 10, 15):
            lab.publish("/joint_states", stamped(JointState, time))
        for time in (12, 13, 20):
            lab.publish("/imu/data", stamped(Imu, time))
        await lab.settle()
        assert lab.node(Controller).got == [(12, 10), (13, 10), (20, 15)]
        assert {line.topic: line.drops for line in lab.ledger} == {
            "/imu/data": {"unpaired": 1}, "/joint_states": {"superseded": 1}
        }  # fmt: skip
        trigger = next(iter(lab.graph.supervisors)).runtime.endpoints.subscriptions[0]
        golden(trigger.remark)


@pytest.mark.parametrize("is_async", [False, True])
def test_failing_handler_fails_its_node(is_async, golden):
    class Broken(Node):
        if is_async:

            @synchronized("a", "b", within=0)
            async def on_pair(self, _a: Image, _b: Image) -> None:
                raise ValueError("no")
        else:

            @synchronized("a", "b", within=0)
            def on_pair(self, _a: Image, _b: Image) -> None:
                raise ValueError("no")

    @virtual_time
    async def run():
        async with harness(Broken) as lab:
            send(lab, "/a", 0)
            send(lab, "/b", 0)
            await lab.advance(1)

    with golden.raises(NodeFailed):
        run()


class Cameras(Node):
    """Two cameras with timers of their own; some frames of the right one are missing, some 30 ms late."""

    left, right = publisher(Image, "left/image"), publisher(Image, "right/image")

    async def start(self) -> None:
        self.sent = 0

    @timer(0.1)
    def shoot_left(self) -> None:
        self.left.publish(image(round(self.clock.seconds() * 1000)))

    @timer(0.1)
    def shoot_right(self) -> None:
        self.sent += 1
        if self.sent % 3:
            self.right.publish(image(round(self.clock.seconds() * 1000) + (30 if self.sent % 4 == 0 else 4)))


@explore(schedules=60)
async def test_no_pair_depends_on_the_order_of_arrival():
    async with harness(Cameras, Stereo) as lab:
        await lab.advance(1.45)
        assert lab.node(Stereo).pairs == [(100, 104), (200, 204), (500, 504), (700, 704), (1000, 1004), (1100, 1104),
                                          (1300, 1304), (1400, 1404)]  # fmt: skip


# What is wrong before the start.


def written(decorate, function):
    return type("Wrong", (Node,), {"on_pair": decorate(function)})


def takes_two(self, left: Image, right: Image) -> None: ...
def takes_one(self, left: Image) -> None: ...


@pytest.mark.parametrize(
    "declare",
    [
        pytest.param(lambda: synchronized("a", within=0), id="one topic"),
        pytest.param(lambda: synchronized("a", "b"), id="no within"),
        pytest.param(lambda: synchronized("a", "b", hold="c"), id="two topics and hold"),
        pytest.param(lambda: synchronized("a", within=1, hold="c"), id="within and hold"),
        pytest.param(lambda: synchronized("a", "b", within="soon"), id="a wrong duration"),
        pytest.param(lambda: synchronized("a", "b", within=-1), id="a negative duration"),
        pytest.param(lambda: synchronized("a", "b", within=0, depth=0), id="no depth"),
        pytest.param(lambda: synchronized("a", 3, within=0), id="a number for a topic"),
        pytest.param(lambda: synchronized("left/image", "2", within=0)(takes_one), id="one argument"),
    ],
)
def test_wrong_declaration_says_what_to_write(declare, golden):
    with golden.raises(InvalidDeclaration):
        declare()


def no_header(self, left: Image, right: Float64) -> None: ...
def no_annotation(self, left: Image, right) -> None: ...
def no_message(self, left: Image, right: int) -> None: ...


@pytest.mark.parametrize(
    "function", [no_header, no_annotation, no_message], ids=["no header", "no annotation", "no message"]
)
def test_type_without_header_is_found_before_the_start(function, golden):
    wrong = written(synchronized("a", "b", within=0), function)
    (problem,) = Graph([wrong]).plan().errors
    golden(problem.message)
    assert problem.place.file.endswith("test_pairing.py")


@virtual_time
async def test_override_without_decorator_stays_synchronized():
    class Sub(Stereo):
        def on_pair(self, left, right):
            super().on_pair(right, left)

    async with harness(Sub) as lab:
        send(lab, "/left/image", 0)
        send(lab, "/right/image", 0)
        await lab.advance(0.1)
        assert lab.node(Sub).pairs == [(0, 0)]


def test_depth_is_the_queue_of_each_topic():
    (planned,) = Graph([Stereo]).plan().nodes
    assert [each.qos for each in planned.subscriptions] == [QoS(depth=3)] * 2


@pytest.mark.asyncio
async def test_doctor_says_how_far_apart_they_are(looked_at, golden):
    async with looked_at(Stereo()) as looked:
        for topic, times in (("/left/image", (0, 100)), ("/right/image", (31, 101))):
            for each in times:
                looked.graph.publish(topic, image(each))
        sub = looked.graph.node(Stereo)
        await looked.until(lambda: sub.pairs)
        tokens, answers = await looked.ask(looked.peer.look)
    texts = [each.message for each in findings(view(tokens, answers), tokens, answers)]
    golden(next(text for text in texts if "/left/image" in text))
