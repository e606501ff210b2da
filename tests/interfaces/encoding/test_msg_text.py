"""A definition says all of a description, and what others wrote is read or refused with its line."""

import contextlib
import pkgutil
from importlib import import_module

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import busflow.msgs
from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.description import rihs01, types_in
from busflow.interfaces.encoding.msg_text import parse, ros2msg
from busflow.interfaces.encoding.typesupport import describe
from busflow.interfaces.message import Message, find_type, type_name

ROS = get_typestore(Stores.LATEST)
MESSAGES = {
    type_name(cls): cls
    for package in pkgutil.iter_modules(busflow.msgs.__path__)
    for module in [import_module(f"busflow.msgs.{package.name}")]
    for cls in (getattr(module, word) for word in module.__all__)
    if issubclass(cls, Message)
}

each_type = pytest.mark.parametrize("name", MESSAGES)


@each_type
def test_a_definition_is_read_back_as_its_description(name):
    described = describe(MESSAGES[name])
    assert parse(name, ros2msg(described)) == described


@each_type
def test_rosbags_reads_the_definition_as_ros_s_type(name):
    for inner, (_, fields) in get_types_from_msg(ros2msg(describe(MESSAGES[name])), name).items():
        known = [field for field in ROS.fielddefs[inner][1] if field[0] != "structure_needs_at_least_one_member"]
        # In a .msg file a char is a uint8, and that is how it is described; rosbags alone keeps the word.
        assert str(fields).replace("'char'", "'uint8'") == str(known).replace("'char'", "'uint8'")


@each_type
def test_the_definition_of_rosbags_describes_the_same_type(name):
    text, _ = ROS.generate_msgdef(name, ros_version=2)
    parsed = parse(name, text.replace("char[16] client_gid", "uint8[16] client_gid"))
    assert rihs01(parsed) == rihs01(describe(MESSAGES[name]))


def test_a_definition_as_recordings_hold_it():
    assert ros2msg(describe(find_type("geometry_msgs/QuaternionStamped"))) == (
        "std_msgs/Header header\n"
        "geometry_msgs/Quaternion quaternion\n"
        "\n" + "=" * 80 + "\nMSG: builtin_interfaces/Time\n"
        "int32 sec\n"
        "uint32 nanosec\n"
        "\n" + "=" * 80 + "\nMSG: geometry_msgs/Quaternion\n"
        "float64 x 0\n"
        "float64 y 0\n"
        "float64 z 0\n"
        "float64 w 1\n"
        "\n" + "=" * 80 + "\nMSG: std_msgs/Header\n"
        "builtin_interfaces/Time stamp\n"
        "string frame_id\n"
    )


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


def test_what_others_write_is_understood():
    described = parse("my_msgs/Message", WRITTEN)
    assert ros2msg(described).splitlines()[:12] == [
        "int32 FIRST=1",
        'string GREETING="say #hello"',
        "string PLAIN=it's fine # or not",
        "std_msgs/Header header",
        "other_msgs/Thing[] things",
        "my_msgs/Neighbour neighbour",
        "string<=10[<=3] words",
        "wstring wide",
        "float64[3] fixed [1, 2, 3]",
        "bool yes true",
        "string text 'a # b'",
        "",
    ]
    assert set(types_in(described)) == {
        "my_msgs/msg/Message",
        "my_msgs/msg/Neighbour",
        "other_msgs/msg/Thing",
        "std_msgs/msg/Header",
    }


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("int32", "line 1"),
        ("int32 x\nfloat64[3 y", "line 2"),
        ("Thing thing", "a/msg/Thing, which a/msg/B needs, is not described"),
        ("int8 x\n===\nint8 y", "followed by the line MSG"),
        ("int8 x\nint8 x", "one name"),
        ("int8[0] x", "one item at least"),
        ("int8[99999999999] x", "32 bits"),
        pytest.param(f"int8[{'9' * 5000}] x", "line 1", id="an array's length of 5000 digits"),
        pytest.param(f"string<={'9' * 5000} x", "line 1", id="a text's bound of 5000 digits"),
        ("Thing A=1", "primitive type"),
        ("B b", "holds itself"),
    ],
)
def test_what_is_no_definition_is_refused(text, reason):
    with pytest.raises(MalformedMessage, match=reason):
        parse("a/msg/B", text)


@given(st.text(st.sampled_from("abint8[]<=>#'\"\\ /\n=AMSG:1"), max_size=60))
def test_any_definition_is_read_without_a_crash(text):
    with contextlib.suppress(MalformedMessage):
        parse("a/msg/B", text)
