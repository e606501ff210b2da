"""Definition files are read whole, or refused with each mistake at its line and column."""

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.definitions.declarations import MAX_DECLARATIONS
from busflow.definitions.reader import MAX_BYTES, MAX_LINE, read_bytes, read_text
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
    "no name": ("int32", 6, "this field has no name"),
    "a constant without a name": ("int32 =1", 6, "this constant has no name"),
    "upper case": ("int32 myField", 7, "'myField' is no name of a field"),
    "two underscores": ("int32 a__b", 7, "did you mean 'a_b'?"),
    "a digit first": ("int32 1st", 7, "'1st' is no name of a field"),
    "a field beginning with an underscore": ("int32 _a", 7, "did you mean 'a'?"),
    "a lower case constant": ("int32 red=1", 7, "did you mean 'RED', or the default `int32 red 1`?"),
    "an array beside its type": ("int32 [3] x", 7, "'[3]' is no name of a field"),
    "a field twice": ("int8 a\nint8 b\nint8 a", 6, "a is declared already, on line 1"),
    "a constant twice": ("int8 A=1\nint8 A=2", 6, "A is declared already, on line 1"),
    "a misspelt primitive": ("flaot64 x", 1, "did you mean 'float64'?"),
    "a word of another language": ("double x", 1, "write float64"),
    "a type of ROS 1": ("time stamp", 1, "write builtin_interfaces/Time"),
    "a lower case message": ("geometry_msgs/point p", 15, "did you mean 'geometry_msgs/Point'?"),
    "a message with underscores": ("point_cloud p", 1, "did you mean 'PointCloud'?"),
    "a bad package": ("Geometry_Msgs/Point p", 1, "'Geometry_Msgs' is no name of a package"),
    "too many parts": ("a/b/c/D x", 1, "'a/b/c/D' names no message"),
    "a bound on a number": ("int32<=5 x", 6, "int32 has no bound"),
    "a bound on a message": ("Point<=5 x", 6, "has no bound"),
    "a bound of nothing": ("string<=0 x", 7, "'<=0' is no bound"),
    "a bound without a number": ("string<= x", 7, "'<=' is no bound"),
    "a smaller sign": ("string<5 x", 7, "'<5' is no bound"),
    "an empty array": ("int32[0] x", 7, "an array has 1 to 4294967295 values"),
    "a negative length": ("int32[-1] x", 7, "'-1' is no length of an array"),
    "a huge length": ("int32[99999999999] x", 7, "'99999999999' is no length of an array"),
    "a bracket left open": ("int32[3 x", 6, "this bracket is not closed"),
    "two arrays": ("int32[2][3] x", 9, "ROS 2 has no arrays of arrays"),
    "a bound without its size": ("int32[<=] x", 7, "a bound needs a number"),
    "a default out of range": ("uint8 x 256", 9, "256 is out of the range of uint8, 0 to 255"),
    "a negative default": ("uint8 x -1", 9, "out of the range"),
    "a float for an integer": ("int32 x 1.5", 9, "1.5 is not a valid int32"),
    "a text for a number": ("float64 x fast", 11, "fast is not a valid float64"),
    "a float32 too large": ("float32 x 1e39", 11, "1e39 is out of the range of float32"),
    "a bool of another language": ("bool x yes", 8, "yes is not a bool; write true or false"),
    "a text too long": ('string<=3 x "abcd"', 13, "4 characters where 3 are allowed"),
    "a quote left open": ('string x "abc', 10, "is not closed"),
    "a quote in a text": ('string x "a"b"', 10, 'write \\" there'),
    "an array without brackets": ("int32[] x 1, 2", 11, "stand in brackets"),
    "an array too short": ("int32[3] x [1, 2]", 12, "exactly 3 values are needed, not 2"),
    "an array too long": ("int32[<=1] x [1, 2]", 14, "at most 1 values are allowed, not 2"),
    "a comma too many": ("int32[] x [1,,2]", 11, "a value is missing between commas"),
    "a comma at the end": ("int32[] x [1,]", 11, "a value is missing after the last comma"),
    "a default of a message": ("Point p 1", 9, "a field that holds a message has no default"),
    "a constant of a message": ("Point P=1", 1, "a constant is one number, bool or text"),
    "a constant without its sign": ("int32 MAX 5", 7, "did you mean 'max', or the constant `int32 MAX=5`?"),
    "a default with a sign": ('string name = "a"', 8, """did you mean 'NAME', or the default `string name "a"`?"""),
    "a comment of C++": ("// up", 1, "a comment begins with #"),
    "a name of C++": ("geometry_msgs::msg::Point p", 1, "did you mean 'geometry_msgs/Point'?"),
    "a constant array": ("int32[] P=[1]", 1, "a constant is one number, bool or text"),
    "a constant without a value": ("int32 A=", 9, "the constant A has no value"),
    "a constant out of range": ("int8 A=200", 8, "200 is out of the range of int8, -128 to 127"),
    "NUL": ("int8 a\x00", 7, r"'\x00' is no character of a definition"),
    "another control character": ("int8 a \x1b[31m", 8, r"'\x1b' is no character"),
    "a line of 2 MiB": ("int8 " + "a" * (1 << 21), 1, f"a line has at most {MAX_LINE} characters"),
    "10,000 fields": (
        "\n".join(f"int8 f{i}" for i in range(10_000)),
        1,
        f"a message has at most {MAX_DECLARATIONS} fields",
    ),
}


@pytest.mark.parametrize(("text", "column", "said"), MISTAKES.values(), ids=MISTAKES.keys())
def test_mistake_is_refused_at_its_column(text, column, said):
    with pytest.raises(InvalidDefinition) as refused:
        read_text("my_msgs/msg/Bad", text, "Bad.msg")
    (problem,) = refused.value.problems
    line = MAX_DECLARATIONS + 1 if text.count("\n") > MAX_DECLARATIONS else text.count("\n") + 1
    assert (problem.place.line, problem.place.column) == (line, column)
    assert str(refused.value).startswith(f"Bad.msg:{line}:{column}: error: ")
    assert said in str(refused.value)
    assert len(str(refused.value)) < 1_000


@pytest.mark.parametrize(
    ("name", "text", "place", "said"),
    [
        ("a/srv/B", b"int8 a", (1, 1), "a service has 2 parts, a line --- between them; this file has 1 part"),
        ("a/action/B", b"---\n", (1, 1), "an action has 3 parts, a line --- between them; this file has 2 parts"),
        ("a/srv/B", b"---\n---\nint8 a", (2, 1), "a service has 2 parts; here begins one more"),
        ("a/msg/B", b"int8 a\n---\nint8 b", (2, 1), "a message has 1 part; here begins one more"),
        ("a/srv/B", b"int8 a\n----\nint8 b", (2, 1), "write ---"),
        ("a/msg/B", b"int8 a\nstring b \xff", (2, 10), "this is no UTF-8"),
        ("a/msg/B", "# é\n# é\xe9".encode("latin-1"), (1, 3), "save the file as UTF-8"),
        ("a/msg/B", b"#" * (MAX_BYTES + 1), (1, 1), f"a definition has at most {MAX_BYTES} bytes"),
    ],
)
def test_mistake_of_a_whole_file_is_refused(name, text, place, said):
    with pytest.raises(InvalidDefinition) as refused:
        read_bytes(name, text, "file")
    (problem,) = refused.value.problems
    assert (problem.place.line, problem.place.column) == place
    assert said in str(refused.value)


def test_all_mistakes_of_a_file_are_listed():
    with pytest.raises(InvalidDefinition) as refused:
        read_text("a/msg/B", "int8 a\nint9 b\nuint8 c 300\nint8 A\n" + "int8\n" * 100, "B.msg")
    assert [problem.place.line for problem in refused.value.problems] == [2, 3, 4, *range(5, 22)]


def test_windows_lines_and_byte_order_mark_are_read():
    read = read_bytes("a/msg/B", b"\xef\xbb\xbfint8 a # one\r\n\r\n# more\r\nint8 b\r\n", "")
    assert [(each.field.name, each.comment) for each in read.parts[0].fields] == [("a", "one"), ("b", "more")]


@given(
    st.sampled_from(["a/msg/B", "a/srv/B", "a/action/B"]),
    st.text(st.sampled_from("abint8string[]<=>#'\"\\ /\n=A1,-.\t"), max_size=80),
)
def test_any_text_is_read_without_a_crash(name, text):
    with contextlib.suppress(InvalidDefinition):
        read_text(name, text, "B")
    read = read_bytes
    with contextlib.suppress(InvalidDefinition):
        read(name, text.encode("utf-16"), "B")
