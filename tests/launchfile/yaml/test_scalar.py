"""Plain scalars: YAML 1.2's core schema, and the differences from ROS 2's parser."""

import math
import re

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from busflow.errors import LaunchError
from busflow.launchfile.load.parameter_file import text_for
from busflow.launchfile.yaml.document import parse, parse_value
from busflow.launchfile.yaml.edit import edit
from busflow.launchfile.yaml.scalar import flow, plain_scalar, written
from busflow.validation.faults import same
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


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("!!str 0483", "0483"),
        ("!!str true", "true"),
        ("!!str ~", "~"),
        ("!!str", ""),
        ("!!float 3", 3.0),
        ('!!float "3"', 3.0),
        ("!!float .nan", math.nan),
        ("!!int 0x10", 16),
        ("!!int '7'", 7),
        ("!!bool yes", True),
        ("!!bool OFF", False),
        ("!<tag:yaml.org,2002:int> 7", 7),
    ],
)
def test_a_tag_states_the_type_of_a_value(text, value):
    found = parse(f"a: {text}\n".encode(), "a.yaml").data["a"]
    assert same(found, value)
    assert same(parse(edit(f"a: {text}\nb: 1\n", ("b",), 2).encode(), "a.yaml").data, {"a": value, "b": 2})
    assert same(parse(edit(f"a: {text}\nb: 1\n", ("a",), 2).encode(), "a.yaml").data, {"a": 2, "b": 1})


@pytest.mark.parametrize(
    "text", ["!!int 1.5", "!!int true", "!!float x", "!!float false", "!!bool 1", "!!bool maybe", "!!int 1" + "0" * 30]
)
def test_a_value_that_is_not_of_its_tag_is_refused_at_its_place(text):
    with pytest.raises(LaunchError) as caught:
        parse(f"b: 1\na: {text}\n".encode(), "a.yaml")
    (problem,) = caught.value.problems
    assert (problem.code, problem.place.line, problem.place.column) == ("tag", 2, 4)


@pytest.mark.parametrize(
    "text", ["!!null x", "!!seq [1]", "!!str [1]", "!!float {a: 1}", "!x 1", "!!timestamp 2001-01-01"]
)
def test_every_other_tag_is_refused(text):
    with pytest.raises(LaunchError) as caught:
        parse(f"a: {text}\n".encode(), "a.yaml")
    assert [(each.code, each.place.line, each.place.column) for each in caught.value.problems] == [("tag", 1, 4)]


def of_rcl(text):
    """Return a plain scalar as rcl_yaml_param_parser reads it: booleans of YAML 1.1, else strtol and strtod of C."""
    if text.lower() in {"y", "n", "yes", "no", "true", "false", "on", "off", "~", "null"}:
        return None
    number = re.compile(
        r"\s*[-+]?(0x[0-9a-f]*\.?[0-9a-f]*(p[-+]?\d+)?|\d+\.?\d*(e[-+]?\d+)?|\.\d+(e[-+]?\d+)?|inf(inity)?|nan(\(\w*\))?|\.inf|\.nan)",
        re.IGNORECASE,
    )
    return None if number.fullmatch(text) else text


WORDS = st.sampled_from(
    [
        "nan",
        "NaN",
        "inf",
        "-inf",
        "+INF",
        "Infinity",
        "infinity",
        ".nan",
        ".Inf",
        "y",
        "N",
        "on",
        "0x1p3",
        "0483",
        "1e3",
        "._1",
        ".5",
        "1_000",
        "12:30:45",
        "2001-01-01",
        "<<",
        "=",
        "~",
        "null",
        "0o17",
        "0b1",
        "1.",
        "+1",
        "nan(x)",
    ]
)


@given(WORDS | st.text("0123456789+-._:eExXnNaAiIfFtTyYoO~", max_size=6) | st.text(max_size=6))
def test_a_written_text_is_that_text_to_every_reader(text):
    for form in (written(text), flow([text])[1:-1], text_for("/a", {"b": text}).partition("b:")[2].strip()):
        if "${" not in text:
            assert yaml.safe_load(f"a: {form}") == {"a": text}
        if form[:1] not in {'"', "'"}:
            assert of_rcl(form) == form
