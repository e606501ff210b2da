"""What a meter counts, on virtual time, and when it is taken off again."""

import asyncio
from typing import Any

import pytest

from busflow import Message
from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.errors import BusflowError, MalformedMessage
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.std_msgs import Int64
from busflow.testing import virtual_time
from busflow.wire.queries import meter as meter_module
from busflow.wire.queries.meter import Meters, Spread


class Odd(Message, package="test_meter"):
    """A message whose `header.stamp` is no time."""

    class Header(Message, package="test_meter"):
        stamp: str = "noon"

    header: Header = Header()


def sizes(of: Any):
    return lambda _topic: of


@virtual_time
async def test_count_and_periods_are_exact(make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    meters = Meters(bench.bus, sizes(lambda message: message.data))
    topic = bench.bus.topics["/number"]
    assert meters.read("me", topic, sizes=True)["count"] == 0
    for number in range(11):
        await asyncio.sleep(0.25)
        publisher.publish(Int64(data=number))
    told = meters.read("me", topic, sizes=True)
    assert (told["topic"], told["count"], told["duration_s"]) == ("/number", 11, 2.75)
    assert told["periods_s"] == {"count": 10, "total": 2.5, "squares": 0.0, "low": 0.25, "high": 0.25}
    assert told["sizes"] == {"count": 11, "total": 55, "squares": 110, "low": 0, "high": 10}
    assert told["ages_s"]["count"] == 0
    assert meters.read("me", topic, sizes=True)["count"] == 0


@virtual_time
async def test_a_reader_does_not_disturb_another_one(make_bench):
    bench = make_bench()
    publisher = bench.publisher()
    meters, topic = Meters(bench.bus, sizes(None)), bench.bus.topics["/number"]
    for reader in ("a", "b"):
        meters.read(reader, topic, sizes=False)
    publisher.publish(Int64(data=1))
    assert meters.read("a", topic, sizes=False)["count"] == 1
    publisher.publish(Int64(data=2))
    assert [meters.read(reader, topic, sizes=False)["count"] for reader in ("a", "b")] == [1, 2]


@virtual_time
async def test_the_age_is_that_of_the_stamp(make_bench):
    bench = make_bench()
    publisher = bench.publisher("/imu", message_type=Imu)
    meters, topic = Meters(bench.bus, sizes(None)), bench.bus.topics["/imu"]
    meters.read("me", topic, sizes=False)
    imu = Imu()
    imu = imu.replace(header=imu.header.replace(stamp=bench.bus.clock.now().to_msg()))
    await asyncio.sleep(0.5)
    publisher.publish(imu)
    assert meters.read("me", topic, sizes=False)["ages_s"]["total"] == 0.5


@virtual_time
async def test_measuring_never_makes_a_publish_fail(make_bench):
    def cannot(_message):
        raise MalformedMessage("no bytes for it")

    bench = make_bench()
    publisher = bench.publisher("/odd", message_type=Odd)
    meters, topic = Meters(bench.bus, sizes(cannot)), bench.bus.topics["/odd"]
    meters.read("me", topic, sizes=True)
    publisher.publish(Odd())
    publisher.publish(Odd())
    told = meters.read("me", topic, sizes=True)
    assert (told["count"], told["odd"], told["sizes"]["count"]) == (2, 2, 0)


@virtual_time
async def test_unread_meter_is_removed(make_bench):
    bench = make_bench()
    bench.publisher()
    meters, topic = Meters(bench.bus, sizes(None)), bench.bus.topics["/number"]
    meters.read("me", topic, sizes=False)
    for _ in range(4):
        await asyncio.sleep(4)
        meters.read("me", topic, sizes=False)
    assert len(topic.taps) == 1
    await asyncio.sleep(11)
    assert topic.taps == []
    assert meters.read("me", topic, sizes=False)["count"] == 0


@virtual_time
async def test_closing_takes_every_meter_off_for_good(make_bench):
    bench = make_bench()
    bench.publisher()
    meters, topic = Meters(bench.bus, sizes(None)), bench.bus.topics["/number"]
    meters.read("me", topic, sizes=False)
    meters.close()
    assert topic.taps == []
    await asyncio.sleep(20)


@virtual_time
async def test_there_is_an_end_to_meters(make_bench, monkeypatch):
    monkeypatch.setattr(meter_module, "_MOST", 3)
    bench = make_bench()
    bench.publisher()
    meters, topic = Meters(bench.bus, sizes(None)), bench.bus.topics["/number"]
    for reader in "abc":
        meters.read(reader, topic, sizes=False)
    with pytest.raises(BusflowError, match="3 "):
        meters.read("d", topic, sizes=False)


def test_a_spread_of_nothing_has_no_extremes():
    assert Spread() == Spread(0, 0.0, 0.0, None, None)


@virtual_time
async def test_remote_messages_are_counted_by_node(make_bench):
    bench = make_bench()
    own, topic = bench.publisher(), bench.bus.topics["/number"]
    remote = [
        Publisher(Int64, Endpoint(node, "/number", Int64, QoS(), node, "/number", remote=True)) for node in ("/a", "/b")
    ]
    for each in remote:
        bench.bus.attach_publisher(each)
    meters = Meters(bench.bus, sizes(None))
    meters.read("me", topic, sizes=False)
    for publisher in (own, *remote, remote[0]):
        await asyncio.sleep(0.25)
        publisher.publish(Int64(data=1))
    told = meters.read("me", topic, sizes=False)
    assert told["count"] == 1
    assert {node: each["count"] for node, each in told["arrived"].items()} == {"/a": 2, "/b": 1}
    assert told["arrived"]["/a"]["periods_s"]["total"] == 0.5
    assert told["publishers"] == [own.endpoint.node]
    assert meters.read("me", topic, sizes=False)["arrived"]["/a"]["count"] == 0
