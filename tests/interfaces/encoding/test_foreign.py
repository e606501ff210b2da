"""A type that only a peer knows is read and written, once what the peer says of it fits the hash."""

import copy
import json

import pytest

from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Message
from busflow.msgs.std_msgs import Header


class Maybe(Message, package="test"):
    value: int | None = None


def foreign(support):
    return ForeignType(support.name, support.type_hash, json.loads(json.dumps(support.description)))


def test_messages_of_ros_are_read_and_written():
    support = TypeSupport(Header)
    peer = foreign(support)
    data = support.encode(Header(frame_id="map"))
    assert peer.decode(data) == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": "map"}
    assert peer.encode({"frame_id": "map"}) == data
    assert peer.definition == support.definition


def test_messages_in_json_are_read_and_written():
    support = TypeSupport(Maybe)
    peer = foreign(support)
    assert peer.decode(support.encode(Maybe(value=3))) == {"value": 3}
    assert support.decode(peer.encode({"value": 4})) == Maybe(value=4)
    assert peer.definition == support.definition


def test_a_description_of_another_hash_is_refused(golden):
    for support in (TypeSupport(Header), TypeSupport(Maybe)):
        description = copy.deepcopy(support.description)
        if support.is_ros:
            description["type_description"]["fields"][1]["name"] = "frame"
        else:
            description["properties"]["values"] = description["properties"].pop("value")
        with golden.raises(MalformedMessage, mask={"[0-9a-f]{64}": "HASH"}):
            ForeignType(support.name, support.type_hash, description)


def test_a_description_of_another_name_is_refused():
    support = TypeSupport(Header)
    with pytest.raises(MalformedMessage):
        ForeignType("std_msgs/msg/String", support.type_hash, support.description)


@pytest.mark.parametrize("description", [None, 3, [], {"$ref": 3}, {"properties": 3}, {"$defs": 3, "$ref": "#/a"}])
@pytest.mark.parametrize("prefix", ["RIHS01_", "JSON01_"])
def test_what_is_no_description_is_refused(prefix, description):
    with pytest.raises(MalformedMessage):
        ForeignType("a/msg/B", prefix + "0" * 64, description)


def test_a_schema_deeper_than_python_allows_is_refused(golden):
    description = {}
    for _ in range(100_000):
        description = {"items": description}
    with golden.raises(MalformedMessage):
        ForeignType("a/msg/B", "JSON01_" + "0" * 64, description)
    while description:  # taken apart by hand: Python itself would end the process over so deep a value
        description = description.pop("items")


def test_what_follows_a_message_is_left_out(golden):
    support = TypeSupport(Header)
    peer = foreign(support)
    data = support.encode(Header(frame_id="map"))
    assert peer.without_surplus(data + b"\7" * 80) == data
    with golden.raises(MalformedMessage):
        peer.without_surplus(data[:-2])


def test_json_has_no_surplus():
    peer = foreign(TypeSupport(Maybe))
    assert peer.without_surplus(b'{"value": 4}') == b'{"value": 4}'
    with pytest.raises(MalformedMessage):
        peer.without_surplus(b'{"value": 4}}')
