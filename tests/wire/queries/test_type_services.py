"""`get_type_description`: the types of a process's topics and services, as ROS 2 describes them."""

import pytest

from busflow.bus.bus import Bus
from busflow.bus.endpoint import Endpoint
from busflow.bus.publisher import Publisher
from busflow.bus.qos import QoS
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.sensor_msgs import Imu
from busflow.msgs.type_description_interfaces import GetTypeDescription
from busflow.wire.queries.type_services import TypeServices

pytestmark = pytest.mark.asyncio
SUPPORT = TypeSupport(Imu)


async def asked(**words):
    bus = Bus()
    bus.attach_publisher(Publisher(Imu, Endpoint("/imu", "/imu/data", Imu, QoS(), "a test", "/imu/data")))
    ((name, _, answer),) = TypeServices(bus, TypeSupport, "/imu").all()
    assert name == "/imu/get_type_description"
    return await answer(GetTypeDescription.Request(**words))


async def test_a_type_is_described_with_those_inside():
    found = await asked(type_name=SUPPORT.name, type_hash=SUPPORT.type_hash)
    assert found.successful
    described = found.type_description
    assert [field.name for field in described.type_description.fields][:2] == ["header", "orientation"]
    inside = [each.type_name for each in described.referenced_type_descriptions]
    assert inside == sorted(inside)
    assert "std_msgs/msg/Header" in inside
    assert [each.type_name for each in found.type_sources] == [SUPPORT.name, *inside]


async def test_sources_are_left_out_on_request():
    assert (await asked(type_name=SUPPORT.name, include_type_sources=False)).type_sources == ()


async def test_an_unknown_type_is_refused_in_words(golden):
    found = await asked(type_name="a/msg/B\x1b", type_hash="RIHS01_1")
    assert not found.successful
    golden(found.failure_reason)
