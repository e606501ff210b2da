"""`@subscription(…, in_frame=…)`: handed over with the transform, or a drop."""

from __future__ import annotations

import pytest

from busflow import Graph, Node, QoS, Time, subscription, timer, transforms
from busflow.clock import SIM_EPOCH_NS
from busflow.errors import InvalidDeclaration, NodeFailed
from busflow.msgs.geometry_msgs import PointStamped, TransformStamped
from busflow.msgs.std_msgs import Float64, Header
from busflow.testing import explore, harness, virtual_time


def point(ms):
    stamp = Time(SIM_EPOCH_NS + ms * 1_000_000).to_msg()
    return PointStamped(header=Header(frame_id="base_link", stamp=stamp))


class Wheels(Node):
    """Sends map → base_link each 50 ms, until 400 ms have passed."""

    frames = transforms()

    @timer(0.05)
    def tick(self) -> None:
        if self.clock.seconds() < 0.41:
            header = Header(stamp=self.clock.now().to_msg(), frame_id="map")
            self.frames.send(TransformStamped(header=header, child_frame_id="base_link"))


class Mapper(Node):
    frames = transforms()

    async def start(self) -> None:
        self.got: list[tuple[int, int]] = []

    @subscription("points", qos=QoS(depth=3), in_frame="map", wait="100ms")
    def on_point(self, message: PointStamped) -> None:
        self.frames.apply(message, "map")
        self.note(message)

    def note(self, message: PointStamped) -> None:
        stamp = message.header.stamp
        ms = round((stamp.sec * 1_000_000_000 + stamp.nanosec - SIM_EPOCH_NS) / 1e6)
        self.got.append((ms, round(self.clock.seconds() * 1000)))


class MapperInTask(Mapper):
    @subscription("points", qos=QoS(depth=3), in_frame="map", wait="100ms")
    async def on_point(self, message: PointStamped) -> None:
        await self.clock.sleep(0.001)
        self.note(message)


@pytest.mark.parametrize(("kind", "late"), [(Mapper, 0), (MapperInTask, 1)])
def test_message_is_handed_over_with_its_transform(kind, late):
    @virtual_time
    async def run():
        async with harness(Wheels, kind) as lab:
            await lab.advance(0.11)
            lab.publish("/points", point(120))
            lab.publish("/points", point(60))
            await lab.advance(0.1)
            assert lab.node(kind).got == [(120, 150 + late), (60, 150 + 2 * late)]

    run()


@virtual_time
async def test_late_message_drops_as_no_transform(golden):
    async with harness(Wheels, Mapper) as lab:
        await lab.advance(0.4)
        lab.publish("/points", point(430))
        await lab.advance(0.099)
        assert lab.ledger.dropped == 0
        await lab.advance(0.002)
        line = next(line for line in lab.ledger if line.topic == "/points")
        assert (line.published, line.delivered, line.drops, line.queued) == (1, 0, {"no_transform": 1}, 0)
        (member,) = (
            received
            for each in lab.graph.supervisors
            for received in each.runtime.endpoints.subscriptions
            if received.topic == "/points"
        )
        golden(member.remark)


@virtual_time
async def test_wait_counts_from_the_arrival_of_each():
    async with harness(Wheels, Mapper) as lab:
        await lab.advance(0.42)
        for each in (430, 440, 450):
            lab.publish("/points", point(each))
        lab.publish("/points", point(460))
        await lab.settle()
        assert next(line for line in lab.ledger if line.topic == "/points").drops == {"no_transform": 1}
        await lab.advance(0.101)
        assert next(line for line in lab.ledger if line.topic == "/points").drops == {"no_transform": 4}


@virtual_time
async def test_full_queue_hands_over_nothing_too_early():
    async with harness(Wheels, Mapper) as lab:
        await lab.advance(0.11)
        for each in (120, 300, 310, 320):
            lab.publish("/points", point(each))
            await lab.settle()  # the first is waited for when the last one pushes it out
        await lab.advance(0.2)
        assert lab.node(Mapper).got == []
        assert next(line for line in lab.ledger if line.topic == "/points").drops == {"no_transform": 4}


def test_failing_handler_fails_its_node():
    class Broken(Mapper):
        def note(self, message: PointStamped) -> None:
            raise ValueError(message.header.frame_id)

    @virtual_time
    async def run():
        async with harness(Wheels, Broken) as lab:
            await lab.advance(0.1)
            lab.publish("/points", point(60))
            await lab.advance(0.1)

    with pytest.raises(NodeFailed, match=r"Mapper\.on_point .*/points"):
        run()


@explore(schedules=40)
async def test_no_message_depends_on_the_order_of_arrival():
    class Sensor(Mapper):
        @timer(0.05)
        def measure(self) -> None:
            self.out.publish(point(round(self.clock.seconds() * 1000)))

        def declare(self) -> None:
            self.out = self.create_publisher(PointStamped, "points")

    async with harness(Wheels, Sensor) as lab:
        await lab.advance(0.38)
        assert [ms for ms, _ in lab.node(Sensor).got] == list(range(50, 351, 50))
        assert lab.ledger.dropped == 0


def no_header(self, message: Float64) -> None: ...


def test_type_without_header_is_found_before_the_start(golden):
    wrong = type("Wrong", (Node,), {"on_point": subscription("points", in_frame="map")(no_header)})
    (problem,) = Graph([wrong]).plan().errors
    golden(problem.message)


@pytest.mark.parametrize(
    "declare",
    [
        pytest.param(lambda: subscription(PointStamped, "points", in_frame="map"), id="no handler"),
        pytest.param(lambda: subscription("points", wait="1s"), id="a wait without a frame"),
        pytest.param(lambda: subscription("points", in_frame=3), id="a number for the frame"),
        pytest.param(lambda: subscription("points", in_frame="map", wait="soon"), id="a wrong duration"),
        pytest.param(
            lambda: subscription("points", in_frame="map")(subscription("other")(no_header)), id="two decorators"
        ),
    ],
)
def test_wrong_declaration_says_what_to_write(declare, golden):
    with golden.raises(InvalidDeclaration):
        declare()
