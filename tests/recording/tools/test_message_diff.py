"""Where two messages differ."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.recording.tools.message_diff import Comparison


def told(left, right, **limits):
    return [str(each) for each in Comparison(**limits).differences(left, right)]


IMU = {"header": {"stamp": {"sec": 1, "nanosec": 5}, "frame_id": "a"}, "x": 1.0, "points": ({"y": 1.0}, {"y": 2.0})}


def test_the_same_is_the_same():
    assert told(IMU, IMU) == []


@pytest.mark.parametrize(
    ("right", "expected"),
    [
        (IMU | {"x": 1.5}, ["x: 1.0 -> 1.5"]),
        (IMU | {"points": ({"y": 1.0}, {"y": 3.0})}, ["points[1].y: 2.0 -> 3.0"]),
        (IMU | {"points": ({"y": 1.0},)}, ["points: 2 values -> 1 values"]),
        (IMU | {"header": {"stamp": {"sec": 1, "nanosec": 6}, "frame_id": "a"}}, None),
        (IMU | {"header": {"stamp": {"sec": 1, "nanosec": 5}, "frame_id": "b\x1b"}}, ["header.frame_id: a -> b\\x1b"]),
        (IMU | {"x": 1}, ["x: 1.0 -> 1"]),
        ({"x": 1.0}, None),
    ],
)
def test_difference_has_its_path(right, expected):
    found = told(IMU, right)
    assert found if expected is None else found == expected


def test_items_of_one_name_are_shown_by_it():
    def event(*parameters):
        return {"new_parameters": tuple({"name": name, "value": {"double_value": value}} for name, value in parameters)}

    assert told(event(("hip.p", 1.0), ("ankle.p", 1.4)), event(("hip.p", 1.0), ("ankle.p", 0.3))) == [
        "new_parameters['ankle.p'].value.double_value: 1.4 -> 0.3"
    ]
    assert told(event(("a", 1.0)), event(("b", 1.0))) == ["new_parameters[0].name: a -> b"]
    assert told(event(("", 1.0)), event(("", 2.0))) == ["new_parameters[0].value.double_value: 1.0 -> 2.0"]
    assert told(event(("a\x1b", 1.0)), event(("a\x1b", 2.0))) == [
        "new_parameters['a\\x1b'].value.double_value: 1.0 -> 2.0"
    ]


def test_times_have_a_tolerance_of_their_own():
    left, right = {"stamp": {"sec": 1, "nanosec": 999_999_999}}, {"stamp": {"sec": 2, "nanosec": 9}}
    assert told(left, right, time_tolerance_ns=10) == []
    assert told(left, right, time_tolerance_ns=9) == ["stamp: 1.999999999 s -> 2.000000009 s"]
    assert told(left, right, tolerance=100.0) != []


def test_arrays_show_their_first_differences(golden):
    left, right = np.arange(100.0), np.arange(100.0)
    right[[5, 7, 9, 11]] += 1
    golden("\n".join(told({"data": memoryview(left)}, {"data": memoryview(right)})))
    assert told({"data": left}, {"data": right}, tolerance=1.0) == []
    assert told({"data": left}, {"data": left[:3]}) == ["data: 100 x float64 -> 3 x float64"]
    assert told({"data": np.array([math.nan, math.inf])}, {"data": np.array([math.nan, math.inf])}) == []


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3).map(tuple) | st.dictionaries(st.text(max_size=3), inner, max_size=3),
    max_leaves=8,
)


@given(plain, plain)
def test_a_difference_is_found_in_both_directions(left, right):
    comparison = Comparison()
    assert list(comparison.differences(left, left)) == []
    there, back = list(comparison.differences(left, right)), list(comparison.differences(right, left))
    assert bool(there) == bool(back)
