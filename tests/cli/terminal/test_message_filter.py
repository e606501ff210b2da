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
from busflow.msgs.sensor_msgs import JointState
from tests.golden import Golden

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
    "text",
    [
        "data >",
        "data = 1",
        "data && ok",
        "(data > 1",
        "data > 1 ok",
        "name == 'a",
        "open('x')",
        "__import__('os')",
        "data.__class__",
        "lambda: 1",
        "-" * 40 + "1",
        "(" * 40,
        "",
        "and",
    ],
)
def test_mistake_is_explained(text: str, golden: Golden):
    with golden.raises(InvalidInput) as caught:
        parse_filter(text, Shape("x/msg/X", {"data": Shape("float64"), "ok": Shape("bool")}))
    assert isinstance(caught.value, InvalidInput)
    assert caught.value.code in ("filter", "path")


def test_length_is_limited(golden: Golden):
    with golden.raises(InvalidInput, mask={r"(?m)^  .*\n?": ""}):
        parse_filter("1 == 1 or " * 200)


def test_caret_shows_the_unknown_field(golden: Golden):
    with golden.raises(InvalidInput):
        parse_filter("header.stamp.secs > 3", JOINTS)


@pytest.mark.parametrize("text", ["name > 3", "data and ok", "data", "header + 1 > 0", "3 in data", "len(data) > 1"])
def test_unfit_values_are_errors(text: str, golden: Golden):
    with golden.raises(InvalidInput):
        parse_filter(text)(MESSAGE)


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
