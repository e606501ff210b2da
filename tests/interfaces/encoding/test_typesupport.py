"""What a class is on the wire, made when it is asked for."""

import json

import pytest
from pydantic import Field

from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.description import fields_of, rihs01
from busflow.interfaces.encoding.typesupport import TypeSupport, describe
from busflow.interfaces.encoding.viewer_schema import source_schema
from busflow.interfaces.message import Message, ServiceType
from busflow.msgs.geometry_msgs import PoseWithCovariance
from busflow.msgs.rcl_interfaces import Log
from busflow.msgs.sensor_msgs import Image, Imu, JointState
from busflow.msgs.std_msgs import Empty, Header, Int64, String
from busflow.msgs.std_srvs import SetBool


def test_a_message_class_describes_topic_and_recording():
    support = TypeSupport(Header)
    assert (support.name, support.encoding, support.definition_encoding) == ("std_msgs/msg/Header", "cdr", "ros2msg")
    assert support.type_hash == "RIHS01_f49fb3ae2cf070f793645ff749683ac6b06203e41c891e17701b1cb597ce6a01"
    assert support.definition.splitlines()[0] == "builtin_interfaces/Time stamp"
    assert support.description == describe(Header)
    json.dumps(support.description)
    assert support.decode(support.encode(Header(frame_id="map"))) == Header(frame_id="map")


def test_a_service_has_a_hash_and_codecs():
    assert issubclass(SetBool, ServiceType)
    assert TypeSupport(SetBool).name == "std_srvs/srv/SetBool"
    assert TypeSupport(SetBool).type_hash == rihs01(describe(SetBool))
    request = TypeSupport(SetBool.Request)
    assert request.name == "std_srvs/srv/SetBool_Request"
    assert request.encode(SetBool.Request(data=True)) == b"\0\1\0\0\1"


def test_constants_and_defaults_are_described():
    constants = describe(Log)["type_description"]["constants"]
    assert constants[0] == {"name": "DEBUG", "type": "uint8", "value": "10"}
    assert [field.default for field in fields_of(describe(Imu)["type_description"])] == [""] * 7


@pytest.mark.parametrize("asked", ["description", "type_hash", "definition", "encode", "decode"])
def test_what_was_made_is_kept(asked):
    support = TypeSupport(JointState)
    assert getattr(support, asked) is getattr(support, asked)


def test_heavy_messages_hold_arrays_and_bulky_ones_bytes():
    kinds = {
        each: (TypeSupport(each).is_heavy, TypeSupport(each).is_bulky) for each in (Image, JointState, Header, SetBool)
    }
    assert kinds == {Image: (True, True), JointState: (True, False), Header: (False, False), SetBool: (False, False)}


def test_types_of_fixed_size_have_a_limit(golden):
    fixed = {each: TypeSupport(each).most_bytes for each in (Empty, SetBool.Request, Int64, PoseWithCovariance)}
    assert {each for each, most in fixed.items() if not len(TypeSupport(each).encode(each())) < most < 600} == set()
    with golden.raises(MalformedMessage):
        TypeSupport(Int64).check_size(1_000_000)
    for any_size in (String, Image, JointState, SetBool):
        TypeSupport(any_size).check_size(10**9)


def test_parts_of_heavy_messages_hold_the_array_itself():
    support, image = TypeSupport(Image), Image(data=bytes(100_000))
    parts = support.encode_in_parts(image)
    assert any(part is image.data for part in parts)
    assert b"".join(bytes(part) for part in parts) == support.encode(image)


def test_definition_of_another_message_is_its_json_schema():
    class Scored(Message, package="test"):
        scores: dict[str, float] = Field(default_factory=dict)

    support = TypeSupport(Scored)
    assert source_schema(json.loads(support.definition)) == support.description == Scored.model_json_schema()
