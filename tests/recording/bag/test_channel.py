"""How the messages of a channel become values, and which cannot."""

import pytest

from busflow.errors import BagError, MalformedMessage
from busflow.msgs.geometry_msgs import Vector3
from busflow.msgs.std_msgs import Bool, Float64
from busflow.recording.bag.channel import Channel

BOOL = Channel("/a", "std_msgs/msg/Bool", "cdr", "bool data\n", "ros2msg")
IDL = "module std_msgs { module msg { struct Bool { boolean data; }; }; };"


def test_channels_are_equal_whatever_their_counts():
    assert Channel("/a", "std_msgs/msg/Bool", "cdr", "bool data\n", "ros2msg", count=7) == BOOL
    assert Channel("/b", "std_msgs/msg/Bool", "cdr", "bool data\n", "ros2msg") != BOOL


def test_messages_become_plain_data_or_messages(golden):
    assert BOOL.plain(b"\0\1\0\0\1") == {"data": True}
    assert BOOL.decode(memoryview(b"\0\1\0\0\1"), Bool) == Bool(data=True)
    with golden.raises(MalformedMessage):
        BOOL.plain(b"\0\1\0\0\2")


def test_json_is_read_as_it_is(golden):
    note = Channel("/n", "odd/msg/Note", "json", '{"type": "object"}', "jsonschema")
    assert note.plain(b'{"text": "a"}') == {"text": "a"}
    with golden.raises(MalformedMessage):
        note.plain(b"{")
    with golden.raises(BagError):
        Channel("/n", "odd/msg/Note", "json", "[" * 100_000, "jsonschema").plain(b"{}")


@pytest.mark.parametrize(
    ("channel", "said"),
    [
        (
            Channel("/a", "std_msgs/Bool", "ros1", "bool data", "ros1msg"),
            "a bag of ROS 1 is converted by rosbags-convert",
        ),
        (Channel("/a", "x/msg/Y", "protobuf", "\x1b", "protobuf"), "is encoded as 'protobuf'; cdr and json are read"),
        (Channel("/a", "x/msg/Y", "cdr", IDL, "ros2idl"), "is described as ros2idl; ros2msg is read"),
        (Channel("/a", "x/msg/Y", "cdr", "", ""), "is described nowhere in the bag; ros2msg is read"),
        (Channel("/a\x1b", "", "cdr", "", ""), r"/a\x1b, without a type, is described nowhere"),
        (Channel("/a", "x/msg/Y", "cdr", "Z z", "ros2msg"), "x/msg/Z, which x/msg/Y needs, is not described"),
        (Channel("/a", "x/msg/Y", "cdr", "Y y", "ros2msg"), "x/msg/Y holds itself"),
        (Channel("/a", "x/msg/Y", "cdr", "bool\n", "ros2msg"), "line 1, column 5: this field has no name"),
        (
            Channel("/a", "std_msgs/msg/Bool", "cdr", "", "", "RIHS01_" + "0" * 64),
            "is another version of the type than the one that busflow brings",
        ),
    ],
)
def test_an_unreadable_payloads_error_names_topic_and_type(channel, said):
    with pytest.raises(BagError) as error:
        channel.plain(b"\0\1\0\0\1")
    assert said in str(error.value)
    assert "\x1b" not in str(error.value)


def test_a_type_that_busflow_brings_needs_no_definition():
    for how, text in (("ros2idl", IDL), ("", "")):
        assert Channel("/a", "std_msgs/msg/Bool", "cdr", text, how).plain(b"\0\1\0\0\1") == {"data": True}


@pytest.mark.parametrize("text", ["", "\n", "# nothing\n", "int8 ONE=1\n", " \r\n"])
@pytest.mark.parametrize("name", ["odd/msg/Ping", "odd/Ping", "std_msgs/msg/Empty"])
@pytest.mark.parametrize("hashed", [True, False])
def test_an_empty_definition_is_a_definition(name, text, hashed):
    type_hash = Channel("/p", name, "cdr", "# nothing", "ros2msg").type.type_hash if hashed else None
    ping = Channel("/p", name, "cdr", text, "ros2msg", type_hash)
    assert (ping.fault, ping.plain(b"\0\1\0\0\0")) == (None, {})


@pytest.mark.parametrize("how", ["", "unknown", "ros2idl"])
def test_a_missing_definition_is_no_empty_one(how):
    assert Channel("/p", "odd/msg/Ping", "cdr", "", how).fault is not None
    assert Channel("/p", "odd/msg/Ping", "cdr", "", "ros2msg", "RIHS01_" + "0" * 64).fault is not None
    assert Channel("/b", "std_msgs/msg/Bool", "cdr", "", how).plain(b"\0\1\0\0\1") == {"data": True}


def test_a_class_of_another_type_is_refused(golden):
    with golden.raises(BagError):
        BOOL.decode(b"\0\1\0\0\1", Float64)
    other = Channel("/v", "geometry_msgs/msg/Vector3", "cdr", "float64 x\nfloat64 y\n", "ros2msg")
    with golden.raises(BagError):
        other.decode(b"\0\1\0\0" + bytes(16), Vector3)


def test_a_huge_definition_takes_no_time():
    """A line of a million quotes, and 200,000 lines."""
    for text in ("string a " + '"' * 1_000_000, "string a " + "'x" * 500_000 + "#", "# x\n" * 200_000):
        with pytest.raises(BagError):
            Channel("/a", "x/msg/Y", "cdr", text + "\nfloat64", "ros2msg").plain(b"")
