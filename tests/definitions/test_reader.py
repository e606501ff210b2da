"""Definition files are read whole, or refused with each mistake at its line and column."""

import contextlib

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from busflow.definitions.reader import MAX_BYTES, read_bytes, read_text
from busflow.errors import InvalidDefinition
from busflow.interfaces.encoding.description import DUMMY

GRIP = b"""\
# How a gripper holds.
#
#   It may hold nothing.

# Whether it is open.
uint8 OPEN=0      # nothing held
uint8 CLOSED = 1  # something held
                  # or nothing
string NAME="a # b"

uint8 state 1
# In newtons.

float32 force 0.5  # at the tips
string<=5[<=2] labels ["a", 'b,c']
geometry_msgs/Point[3] contacts
Finger[] fingers
wstring wide
# The end.
"""


def test_message_is_read_with_all_it_states():
    read = read_bytes("my_msgs/msg/Grip", GRIP, "Grip.msg")
    (part,) = read.parts
    assert read.comment == "How a gripper holds.\n\n  It may hold nothing.\n\nThe end."
    assert [(each.name, each.base, each.value, each.comment) for each in part.constants] == [
        ("OPEN", "uint8", 0, "Whether it is open.\n\nnothing held"),
        ("CLOSED", "uint8", 1, "something held\nor nothing"),
        ("NAME", "string", "a # b", ""),
    ]
    assert [(each.field.name, each.field.base, each.default, each.comment) for each in part.fields] == [
        ("state", "uint8", 1, ""),
        ("force", "float32", 0.5, "In newtons.\n\nat the tips"),
        ("labels", "string", ("a", "b,c"), ""),
        ("contacts", "geometry_msgs/msg/Point", None, ""),
        ("fingers", "my_msgs/msg/Finger", None, ""),
        ("wide", "wstring", None, ""),
    ]
    assert [name for name, _ in read.needs()] == ["geometry_msgs/msg/Point", "my_msgs/msg/Finger"]


def test_only_comment_is_about_the_whole_message():
    alone = read_bytes("a/msg/B", b"# A point.\nfloat64 x\nfloat64 y # up\n", "")
    assert (alone.comment, [each.comment for each in alone.parts[0].fields]) == ("A point.", ["", "up"])
    several = read_bytes("a/msg/B", b"# To the right.\nfloat64 x\n# Up.\nfloat64 y\n", "")
    assert (several.comment, [each.comment for each in several.parts[0].fields]) == ("", ["To the right.", "Up."])


def test_action_has_three_parts_and_derived_types():
    text = b"# Moves.\n\n# Where to.\n\n# Radians.\nfloat64 angle\n---\n# What came of it.\n\nbool reached\n---\n"
    read = read_bytes("a/action/Move", text, "Move.action")
    assert [(each.name, each.comment) for each in read.parts] == [
        ("a/action/Move_Goal", "Where to."),
        ("a/action/Move_Result", "What came of it."),
        ("a/action/Move_Feedback", ""),
    ]
    assert (read.comment, read.parts[0].fields[0].comment) == ("Moves.", "Radians.")
    types = read.types()
    assert {
        "a/action/Move",
        "a/action/Move_SendGoal",
        "a/action/Move_GetResult_Event",
        "a/action/Move_FeedbackMessage",
    } < types.keys()
    assert [field["name"] for field in types["a/action/Move_Feedback"]["fields"]] == [DUMMY]
    assert [field["name"] for field in types["a/action/Move_SendGoal_Response"]["fields"]] == ["accepted", "stamp"]


MISTAKES = {
    "no name": "int32",
    "a constant without a name": "int32 =1",
    "upper case": "int32 myField",
    "two underscores": "int32 a__b",
    "a digit first": "int32 1st",
    "a field beginning with an underscore": "int32 _a",
    "a lower case constant": "int32 red=1",
    "an array beside its type": "int32 [3] x",
    "a field twice": "int8 a\nint8 b\nint8 a",
    "a constant twice": "int8 A=1\nint8 A=2",
    "a misspelt primitive": "flaot64 x",
    "a word of another language": "double x",
    "a type of ROS 1": "time stamp",
    "a lower case message": "geometry_msgs/point p",
    "a message with underscores": "point_cloud p",
    "a bad package": "Geometry_Msgs/Point p",
    "too many parts": "a/b/c/D x",
    "a bound on a number": "int32<=5 x",
    "a bound on a message": "Point<=5 x",
    "a bound of nothing": "string<=0 x",
    "a bound without a number": "string<= x",
    "a smaller sign": "string<5 x",
    "an empty array": "int32[0] x",
    "a negative length": "int32[-1] x",
    "a huge length": "int32[99999999999] x",
    "a bracket left open": "int32[3 x",
    "two arrays": "int32[2][3] x",
    "a bound without its size": "int32[<=] x",
    "a default out of range": "uint8 x 256",
    "a negative default": "uint8 x -1",
    "a float for an integer": "int32 x 1.5",
    "a text for a number": "float64 x fast",
    "a float32 too large": "float32 x 1e39",
    "a bool of another language": "bool x yes",
    "a text too long": 'string<=3 x "abcd"',
    "a quote left open": 'string x "abc',
    "a quote in a text": 'string x "a"b"',
    "an array without brackets": "int32[] x 1, 2",
    "an array too short": "int32[3] x [1, 2]",
    "an array too long": "int32[<=1] x [1, 2]",
    "a comma too many": "int32[] x [1,,2]",
    "a comma at the end": "int32[] x [1,]",
    "a default of a message": "Point p 1",
    "a constant of a message": "Point P=1",
    "a constant without its sign": "int32 MAX 5",
    "a default with a sign": 'string name = "a"',
    "a comment of C++": "// up",
    "a name of C++": "geometry_msgs::msg::Point p",
    "a constant array": "int32[] P=[1]",
    "a constant without a value": "int32 A=",
    "a constant out of range": "int8 A=200",
    "NUL": "int8 a\x00",
    "another control character": "int8 a \x1b[31m",
    "a line of 2 MiB": "int8 " + "a" * (1 << 21),
    "10,000 fields": "\n".join(f"int8 f{i}" for i in range(10_000)),
}


@pytest.mark.parametrize("text", MISTAKES.values(), ids=MISTAKES.keys())
def test_mistake_is_refused_at_its_column(text, golden):
    with golden.raises(InvalidDefinition) as refused:
        read_text("my_msgs/msg/Bad", text, "Bad.msg")
    assert len(refused.value.problems) == 1
    assert len(str(refused.value)) < 1_000


WHOLE_FILES = {
    "one part for a service": ("a/srv/B", b"int8 a"),
    "two parts for an action": ("a/action/B", b"---\n"),
    "three parts for a service": ("a/srv/B", b"---\n---\nint8 a"),
    "two parts for a message": ("a/msg/B", b"int8 a\n---\nint8 b"),
    "a line of four signs": ("a/srv/B", b"int8 a\n----\nint8 b"),
    "a byte that is no UTF-8": ("a/msg/B", b"int8 a\nstring b \xff"),
    "Latin 1": ("a/msg/B", "# é\n# é\xe9".encode("latin-1")),
    "a file too long": ("a/msg/B", b"#" * (MAX_BYTES + 1)),
}


@pytest.mark.parametrize(("name", "text"), WHOLE_FILES.values(), ids=WHOLE_FILES.keys())
def test_mistake_of_a_whole_file_is_refused(name, text, golden):
    with golden.raises(InvalidDefinition):
        read_bytes(name, text, "file")


def test_all_mistakes_of_a_file_are_listed():
    with pytest.raises(InvalidDefinition) as refused:
        read_text("a/msg/B", "int8 a\nint9 b\nuint8 c 300\nint8 A\n" + "int8\n" * 100, "B.msg")
    assert [problem.place.line for problem in refused.value.problems] == [2, 3, 4, *range(5, 22)]


def test_windows_lines_and_byte_order_mark_are_read():
    read = read_bytes("a/msg/B", b"\xef\xbb\xbfint8 a # one\r\n\r\n# more\r\nint8 b\r\n", "")
    assert [(each.field.name, each.comment) for each in read.parts[0].fields] == [("a", "one"), ("b", "more")]


WORDS = ["msg", "srv", "action", "time", "Header", "string", "uint8", "float32", "nan", "1", "A", "x", "é", "---"]


@given(
    st.sampled_from(["a/msg/B", "a/srv/B", "a/action/B"]),
    st.one_of(
        st.text(st.sampled_from("abint8string[]<=>#'\"\\ /\n=A1,-.\t"), max_size=80),
        st.lists(st.sampled_from([*WORDS, *" \n/[]<=#'\".-_"]), max_size=20).map("".join),
    ),
)
@example("a/msg/B", "msg s")
def test_any_text_is_read_without_a_crash(name, text):
    with contextlib.suppress(InvalidDefinition):
        read_text(name, text, "B")
    read = read_bytes
    with contextlib.suppress(InvalidDefinition):
        read(name, text.encode("utf-16"), "B")
