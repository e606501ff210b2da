"""Parameters as ROS 2's messages: values there and back, descriptors, events."""

import json
from pathlib import Path
from typing import Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field

from busflow import Parameters
from busflow.msgs.rcl_interfaces import ParameterType, ParameterValue
from busflow.node.parameter_messages import descriptor_message, plain_value, type_of, value_message
from busflow.node.parameters import ReadOnly, describe
from tests.vectors import each_case


@each_case("f_parameters", "infer_type/")
def test_a_value_has_the_type_of_rclpy(case):
    assert type_of(case["input"]) == getattr(ParameterType, f"PARAMETER_{case['expect']}")


INT64 = st.integers(-(2**63), 2**63 - 1)
SCALARS = st.none() | st.booleans() | INT64 | st.floats(allow_nan=False) | st.text()


@given(
    SCALARS
    | st.lists(st.booleans(), min_size=1)
    | st.lists(INT64, min_size=1)
    | st.lists(st.floats(allow_nan=False), min_size=1)
    | st.lists(st.text())
)
def test_a_ros_2_value_survives_the_round_trip(value):
    back = plain_value(value_message(value))
    assert back == value
    assert type(back) is type(value)


@pytest.mark.parametrize("value", [None, True, 3, 2.5, "a", [True, False], [1, -2], [0.5, 2.0], ["a", "b"]])
def test_one_value_of_each_type_survives(value):
    assert plain_value(value_message(value)) == value


@pytest.mark.parametrize("value", [{"kp": 1.0}, [{"name": "knee"}], [1, "a"], [[1]], 2**70, [2**70], [True, 1]])
def test_a_type_unknown_to_ros_becomes_json(value):
    message = value_message(value)
    assert message.type == ParameterType.PARAMETER_STRING
    assert json.loads(message.string_value) == value


class Everything(Parameters):
    rate_hz: float = Field(default=10.0, gt=0, le=1000, description="How often.")
    count: int = Field(default=3, ge=0, multiple_of=2)
    limit: float | None = None
    frame: ReadOnly[str] = "imu_link"
    mode: Literal["slow", "fast"] = "slow"
    names: tuple[str, ...] = ()
    offsets: tuple[float, ...] = ()
    file: Path = Path("a.yaml")
    gains: dict[str, float] = Field(default_factory=dict)


INFOS = {info.name: info for info in describe(Everything)}


def test_an_empty_list_is_of_the_declared_type():
    assert value_message([], INFOS["offsets"]).type == ParameterType.PARAMETER_DOUBLE_ARRAY
    assert value_message([]).type == ParameterType.PARAMETER_STRING_ARRAY


def test_an_unknown_type_of_value_is_not_set():
    assert plain_value(ParameterValue(type=200)) is None


@pytest.mark.parametrize(("low", "first"), [(1, 2), (2, 2), (-3, -2), (None, -(2**63))])
def test_steps_count_from_an_allowed_value(low, first):
    class Stepped(Parameters):
        count: int = Field(default=4, ge=low, le=9, multiple_of=2)
        rate_hz: float = Field(default=4, ge=low, le=9, multiple_of=2)

    count, rate = (descriptor_message(info) for info in describe(Stepped))
    (integers,), (floats,) = count.integer_range, rate.floating_point_range
    assert (integers.from_value, integers.step) == (first, 2)
    assert (floats.from_value, floats.step) == (float("-inf") if low is None else first, 2.0)


@pytest.mark.parametrize(
    ("limits", "ends"),
    [
        ({"gt": 2, "lt": 8}, (4, 6)),
        ({"gt": 1, "lt": 9}, (2, 8)),
        ({"ge": -3, "le": 9}, (-2, 8)),
        ({"le": 9}, (-(2**63), 8)),
    ],
)
def test_a_range_ends_at_allowed_steps(limits, ends):
    class Stepped(Parameters):
        count: int = Field(default=4, multiple_of=2, **limits)
        rate_hz: float = Field(default=4, multiple_of=2, **limits)

    count, rate = (descriptor_message(info) for info in describe(Stepped))
    (integers,), (floats,) = count.integer_range, rate.floating_point_range
    assert (integers.from_value, integers.to_value) == ends
    assert (floats.from_value, floats.to_value) == (ends[0] if ends[0] > -9 else float("-inf"), ends[1])


def test_a_range_of_tenths_has_exact_ends():
    class Tenths(Parameters):
        gain: float = Field(default=0.5, ge=0.3, lt=0.7, multiple_of=0.1)
        free: float = Field(default=0.5, ge=0.3, le=float("inf"), multiple_of=0.1)

    gain, free = (descriptor_message(info).floating_point_range[0] for info in describe(Tenths))
    assert (gain.from_value, gain.to_value) == (0.3, 0.6)
    assert (free.from_value, free.to_value) == (0.3, float("inf"))


def test_an_integer_range_excludes_its_limits():
    class Count(Parameters):
        count: int = Field(default=4, gt=0, lt=9)

    (info,) = describe(Count)
    (integers,) = descriptor_message(info).integer_range
    assert (integers.from_value, integers.to_value, integers.step) == (1, 8, 0)


def test_a_descriptor_says_what_is_declared(golden):
    rate, count = descriptor_message(INFOS["rate_hz"]), descriptor_message(INFOS["count"])
    (floats,), (integers,) = rate.floating_point_range, count.integer_range
    assert (rate.name, rate.description, rate.type) == ("rate_hz", "How often.", ParameterType.PARAMETER_DOUBLE)
    assert (floats.from_value, floats.to_value, floats.step) == (0.0, 1000.0, 0.0)
    golden(rate.additional_constraints)
    assert (integers.from_value, integers.to_value, integers.step) == (0, 2**63 - 2, 2)
    assert descriptor_message(INFOS["frame"]).read_only
    golden(descriptor_message(INFOS["mode"]).additional_constraints)
    kinds = {name: descriptor_message(info).type for name, info in INFOS.items()}
    assert kinds == {
        "rate_hz": ParameterType.PARAMETER_DOUBLE,
        "count": ParameterType.PARAMETER_INTEGER,
        "limit": ParameterType.PARAMETER_DOUBLE,
        "frame": ParameterType.PARAMETER_STRING,
        "mode": ParameterType.PARAMETER_STRING,
        "names": ParameterType.PARAMETER_STRING_ARRAY,
        "offsets": ParameterType.PARAMETER_DOUBLE_ARRAY,
        "file": ParameterType.PARAMETER_STRING,
        "gains": ParameterType.PARAMETER_STRING,
    }
