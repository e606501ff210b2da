"""Plain scalars: YAML 1.2's core schema, and the differences from ROS 2's parser."""

import math

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from busflow.launchfile.yaml.document import parse, parse_value
from busflow.launchfile.yaml.scalar import plain_scalar
from tests.golden import Golden
from tests.vectors import each_case


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("", None),
        ("~", None),
        ("null", None),
        ("Null", None),
        ("nULL", "nULL"),
        ("true", True),
        ("FALSE", False),
        ("yes", "yes"),
        ("On", "On"),
        ("no", "no"),
        ("12:30", "12:30"),
        ("12:30:45", "12:30:45"),
        ("010", 10),
        ("+5", 5),
        ("-0", 0),
        ("0o10", 8),
        ("0x1F", 31),
        ("0b1", "0b1"),
        ("1_000", "1_000"),
        ("1e3", 1000.0),
        ("1.", 1.0),
        (".5", 0.5),
        ("-.INF", -math.inf),
        ("+.inf", math.inf),
        ("inf", "inf"),
        ("nan", "nan"),
        ("2026-01-01", "2026-01-01"),
        ("9223372036854775807", 2**63 - 1),
        ("-9223372036854775808", -(2**63)),
        ("0x7fffffffffffffff", 2**63 - 1),
        ("0" * 3000 + "7", 7),
    ],
)
def test_the_core_schema_of_yaml_1_2(text: str, value: object):
    found = plain_scalar(text)
    assert found == value
    assert type(found) is type(value)


def test_nan_is_read_as_a_number():
    assert math.isnan(plain_scalar(".NaN"))


@pytest.mark.parametrize(
    "text",
    ["9223372036854775808", "-9223372036854775809", "9" * 5000, "0x" + "f" * 5000, "1e999"],
    ids=lambda text: text[:24],  # pytest shortens long ones in its newer versions alone
)
def test_integer_beyond_64_bits_is_refused(text: str, golden: Golden):
    with golden.raises(ValueError):
        plain_scalar(text)


@given(st.text(max_size=12))
def test_any_text_is_a_scalar_or_refused(text: str):
    try:
        value = plain_scalar(text)
    except ValueError:
        return
    assert not isinstance(value, str) or value == text


@given(st.one_of(st.none(), st.booleans(), st.integers(-(2**63), 2**63 - 1), st.floats(allow_nan=False)))
def test_scalars_from_pyyaml_are_read_back(value: object):
    written = repr(value).lower().replace("inf", ".inf") if value is not None else "null"
    assert plain_scalar(written) == value
    assert type(plain_scalar(written)) is type(value)


@given(st.text())
def test_quoted_text_is_read_back_unchanged(text: str):
    document = yaml.safe_dump({"key": text}, default_style='"', allow_unicode=False)
    assert parse(document.encode(), "file").data == {"key": text}


YAML_1_1 = "YAML 1.1: in YAML 1.2 this is text"


@each_case("f_parameters", "yaml_scalar/")
def test_scalars_agree_with_rcl(case: dict[str, str]):
    kind, expected = case["expect"]
    found = parse_value(case["input"], "command line").data
    assert type(found).__name__ == kind
    assert str(found) == str(expected)
