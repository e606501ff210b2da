"""Stated values are read as ROS 2's own parser reads them, and written so that they are read back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.interfaces.encoding.description import Count, Field, written
from busflow.interfaces.encoding.stated_values import scalar, value_of


@pytest.mark.parametrize(
    ("base", "text", "value"),
    [
        ("int8", "-128", -128),
        ("uint64", "18446744073709551615", (1 << 64) - 1),
        ("int32", "010", 10),
        ("int32", "0x1F", 31),
        ("int32", "-0b11", -3),
        ("float64", "1", 1.0),
        ("float64", ".5", 0.5),
        ("float32", "1e-3", 1e-3),
        ("float64", "-INF", float("-inf")),
        ("bool", "True", True),
        ("bool", "0", False),
        ("string", "plain text", "plain text"),
        ("string", "it's", "it's"),
        ("string", r'"a \"b\" \n"', r'a "b" \n'),
        ("wstring", "''", ""),
    ],
)
def test_value_is_read(base, text, value):
    assert scalar(base, text) == value
    assert type(scalar(base, text)) is type(value)


@pytest.mark.parametrize(
    ("base", "text"),
    [("int8", "128"), ("int8", "1_0"), ("int8", ""), ("float64", "1_0"), ("float32", "4e38"), ("int64", "9" * 5000)],
)
def test_what_is_no_value_is_refused(base, text):
    with pytest.raises(ValueError, match=base):
        scalar(base, text)


@given(st.text(st.characters(codec="utf-8", exclude_categories=["Cc"])) | st.booleans() | st.integers(-99, 99))
def test_written_value_is_read_back(value):
    base = {str: "string", bool: "bool", int: "int8"}[type(value)]
    assert scalar(base, written(value)) == value


@given(st.lists(st.text(st.characters(codec="utf-8", exclude_categories=["Cc"], exclude_characters="\\"))))
def test_written_array_is_read_back(values):
    field = Field("a", "string", count=Count.UNBOUNDED, default=f"[{', '.join(map(written, values))}]")
    assert value_of(field) == tuple(values)


@pytest.mark.parametrize(
    "field",
    [
        Field("a", "int8", count=Count.FIXED, size=2, default="[1]"),
        Field("a", "int8", count=Count.BOUNDED, size=1, default="[1, 2]"),
        Field("a", "int8", count=Count.UNBOUNDED, default="1, 2"),
        Field("a", "int8", count=Count.UNBOUNDED, default="[1,,2]"),
        Field("a", "int8", count=Count.UNBOUNDED, default="[1,]"),
        Field("a", "bool", default="yes"),
        Field("a", "string", default="'ahoy"),
        Field("a", "string", default="'a'b'"),
        Field("a", "string", string_bound=2, default="abc"),
    ],
    ids=lambda field: f"{field.base} {field.count.name} {field.default}",
)
def test_default_that_breaks_a_rule_is_refused(golden, field):
    with golden.raises(ValueError):
        value_of(field)
