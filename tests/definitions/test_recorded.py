"""Definitions that recordings hold are read, whatever wrote them, or refused with their line."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_typestore

from busflow.definitions.reader import MAX_BYTES, read_text
from busflow.definitions.recorded import parse
from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.description import rihs01, types_in
from busflow.interfaces.encoding.msg_text import ros2msg

WRITTEN = """
# A comment, and a blank line

int32 FIRST=1   # the first
string GREETING = "say #hello"
string PLAIN=it's fine # or not
Header header
other_msgs/Thing[] things
Neighbour  neighbour
string<=10[<=3] words
wstring wide
float64[3] fixed [1, 2, 3]
bool yes true # yes
string text 'a # b'
================================================================================
MSG: std_msgs/Header
string frame_id
===
MSG: other_msgs/msg/Thing
int8 x
===
MSG: my_msgs/Neighbour
char c
byte b
"""


def test_what_others_write_is_understood(golden):
    described = parse("my_msgs/Message", WRITTEN)
    golden(ros2msg(described))
    assert set(types_in(described)) == {
        "my_msgs/msg/Message",
        "my_msgs/msg/Neighbour",
        "other_msgs/msg/Thing",
        "std_msgs/msg/Header",
    }


MISTAKES = {
    "no name": "int32",
    "a bracket left open": "int32 x\nfloat64[3 y",
    "an undescribed type": "Thing thing",
    "a separator alone": "int8 x\n===\nint8 y",
    "a field twice": "int8 x\nint8 x",
    "an empty array": "int8[0] x",
    "a huge array": "int8[99999999999] x",
    "an array's length of 5000 digits": f"int8[{'9' * 5000}] x",
    "a text's bound of 5000 digits": f"string<={'9' * 5000} x",
    "a constant of a message": "Thing A=1",
    "a type in itself": "B b",
    "no name in the second part": "C c\n===\nMSG: a/C\n\nint\n",
    "a text too long": "#" * (MAX_BYTES + 1),
}


@pytest.mark.parametrize("text", MISTAKES.values(), ids=MISTAKES.keys())
def test_what_is_no_definition_is_refused(text, golden):
    with golden.raises(MalformedMessage):
        parse("a/msg/B", text)


@given(st.text(st.sampled_from("abint8[]<=>#'\"\\ /\n=AMSG:1"), max_size=60))
def test_any_definition_is_read_without_a_crash(text):
    with contextlib.suppress(MalformedMessage):
        parse("a/msg/B", text)


@pytest.mark.parametrize("store", [Stores.ROS2_HUMBLE, Stores.ROS2_JAZZY, Stores.LATEST], ids=lambda store: store.value)
def test_every_definition_of_ros_is_read(store):
    """Strictly as a file, and as a recording holds it; the hash is the one that rosbags computes."""
    known = get_typestore(store)
    assert len(known.fielddefs) > 100
    for name in known.fielddefs:
        text, _ = known.generate_msgdef(name, ros_version=2)
        assert read_text(name, text.partition("=" * 80)[0], name).parts[0].name == name
        if "char" not in text:  # which rosbags does not hash as ROS 2 does
            assert (name, rihs01(parse(name, text))) == (name, known.hash_rihs01(name))


def test_events_are_described_by_their_service():
    event = parse("a/srv/Add_Event", "int64 a\n---\nint64 sum\n")
    assert set(types_in(event)) == {
        "a/srv/Add_Event",
        "a/srv/Add_Request",
        "a/srv/Add_Response",
        "builtin_interfaces/msg/Time",
        "service_msgs/msg/ServiceEventInfo",
    }
