"""`--filter`: parsing conditions, evaluating them on messages, and the errors of wrong ones."""

import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.cli.terminal.field_paths import Shape, shape_of
from busflow.cli.terminal.message_filter import parse_filter
from busflow.errors import InvalidInput
from busflow.interfaces.encoding.description import Count
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.launchfile.load.language import MAX_LENGTH
from busflow.msgs.sensor_msgs import JointState

MESSAGE = {
    "header": {"frame_id": "imu_link", "stamp": {"sec": 3, "nanosec": 0}},
    "name": ("a", "b"),
    "position": memoryview(b"\x01\x02\x03"),
    "data": 0.5,
    "ok": True,
}
SUPPORT = TypeSupport(JointState)
JOINTS = shape_of(ForeignType(SUPPORT.name, SUPPORT.type_hash, SUPPORT.description))


@pytest.mark.parametrize(
    "text",
    [
        "data > 0.4",
        "m.data>0.4",
        "m.header.stamp.sec == 3 and header.frame_id == 'imu_link'",
        "not ok or data < 1",
        "ok",
        "not (data > 1)",
        "0 < data < 1",
        "len(name) == 2 and len(m.position) == 3",
        "abs(-data) == .5",
        "max(position) == 3 and min(position) == 1",
        "position[0] + position[-1] * 2 == 7",
        "-data - -1 == 0.5",
        "'link' in header.frame_id",
        '"c" not in name',
        "2 in position",
        "position[0] in [1, 5] and not position[ 1 ] in[data, [2]]",
        "7 % 4 == 3 and 7 / 2 == 3.5",
        "1 / (data - 0.5) > 1e308",
        "0 / 0 != 0 / 0",
        "ok != 1",
        "m.ok == True and ok == true",
    ],
)
def test_conditions_hold(text: str):
    assert parse_filter(text)(MESSAGE) is True
    assert parse_filter(f"not ({text})")(MESSAGE) is False


@pytest.mark.parametrize("text", ["position[3] > 0", "not position[3] > 0", "nope == 1", "max(m.none) > 0"])
def test_missing_value_makes_the_filter_false(text: str):
    assert parse_filter(text)({**MESSAGE, "none": ()}) is False


def test_the_whole_may_be_a_number():
    assert parse_filter("m > 9.8")(9.9)
    assert not parse_filter("m > 9.8")(math.nan)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("data >", "a value is missing"),
        ("data = 1", "'=' is not part of the language"),
        ("data && ok", "write and"),
        ("(data > 1", "')' is missing"),
        ("data > 1 ok", "'ok' is not expected here"),
        ("name == 'a", "a quote is never closed"),
        ("open('x')", "there is no function open"),
        ("__import__('os')", "there is no function __import__"),
        ("data.__class__", "__class__"),
        ("lambda: 1", "':' is not part of the language"),
        ("-" * 40 + "1", "nests at most"),
        ("(" * 40, "nests at most"),
        ("1 == 1 or " * 200, f"at most {MAX_LENGTH} characters"),
        ("", "a value is missing"),
        ("and", "a value is missing before 'and'"),
    ],
)
def test_mistake_is_explained(text: str, expected: str):
    with pytest.raises(InvalidInput) as caught:
        assert parse_filter(text, Shape("x/msg/X", {"data": Shape("float64"), "ok": Shape("bool")}))({})
    assert expected in str(caught.value)


def test_caret_shows_the_unknown_field():
    with pytest.raises(InvalidInput) as caught:
        parse_filter("header.stamp.secs > 3", JOINTS)
    assert str(caught.value).splitlines() == [
        "--filter:1:14: error: builtin_interfaces/msg/Time has no field secs",
        "  header.stamp.secs > 3",
        "               ^^^^",
        "  fix: did you mean 'sec'?",
    ]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("name > 3", "cannot compare ('a', 'b') with 3"),
        ("data and ok", "'and' needs true or false, got 0.5"),
        ("data", "a filter needs true or false"),
        ("header + 1 > 0", "calculates with numbers"),
        ("3 in data", "cannot look for 3 in 0.5"),
        ("len(data) > 1", "len() cannot take 0.5"),
    ],
)
def test_unfit_values_are_errors(text: str, expected: str):
    with pytest.raises(InvalidInput) as caught:
        parse_filter(text)(MESSAGE)
    assert expected in str(caught.value)


PIECES = st.sampled_from(["m.a", "(", ")", "and", "or", "not", "in", "len(", "1", "'x'", *"+-*/%<,.", "==", "[0]"])


@given(st.text() | st.lists(PIECES).map(" ".join))
def test_any_text_is_a_filter_or_an_error(text: str):
    with suppress(InvalidInput):
        parse_filter(text)({"a": 1})


@given(st.integers(-9, 9), st.integers(-9, 9), st.integers(1, 9))
def test_it_calculates_as_python_does(a: int, b: int, c: int):
    wanted = (a + b * c - (a - b) % c) / c
    assert parse_filter("(a + b * c - (a - b) % c) / c == wanted")({"a": a, "b": b, "c": c, "wanted": wanted})


def test_a_sequence_is_no_message():
    with pytest.raises(InvalidInput):
        parse_filter("m.x > 1", Shape("a/msg/B", {"x": Shape("float64")}, Count.UNBOUNDED))
