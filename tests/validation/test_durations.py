"""Tests of `durations.py`: text to seconds and back, exact to the nanosecond."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.validation.durations import parse_duration, show_duration


@given(st.integers(1, 10**15))
def test_a_shown_duration_reads_as_itself(ns):
    assert parse_duration(show_duration(ns / 1e9)) == parse_duration(ns / 1e9) == ns / 1e9


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("10min", 600),
        ("1.5h", 5400),
        (" 20 ms ", 0.02),
        ("3us", 3e-6),
        ("7ns", 7e-9),
        (float("inf"), float("inf")),
    ],
)
def test_duration_is_read_with_its_unit(text, seconds):
    assert parse_duration(text) == seconds


@pytest.mark.parametrize("text", ["", "s", "5", "5 m", "-5s", "1,5s", "٥s", "5s\n6s", "1" * 400 + "s", None, True])
def test_invalid_duration_is_refused_with_an_example(text, golden):
    with golden.raises(ValueError):
        parse_duration(text)


@pytest.mark.parametrize("value", [0, "0s", 1e-10, 1e300, -1, float("-inf")])
def test_impossible_duration_is_refused(value, golden):
    with golden.raises(ValueError):
        parse_duration(value)
