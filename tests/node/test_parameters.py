"""Parameters: strict about types, ranges and names, and every fault told in one go."""

import math
from enum import Enum, IntEnum
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, ValidationError, create_model, model_validator
from pydantic.version import version_short

from busflow.errors import Fault, InvalidDeclaration, InvalidParameter
from busflow.node.parameters import Parameters, ReadOnly, describe, grouped, validate, value_of
from tests.vectors import each_case


class Mode(Enum):
    FAST = "fast"
    SLOW = "slow"


class Level(IntEnum):
    LOW = 1
    HIGH = 2


class Noise(Parameters):
    imu: float = Field(default=0.1, ge=0, le=10, description="Half width of the noise.")
    low: float = 0.0
    high: float = 1.0

    @model_validator(mode="after")
    def _ordered(self) -> "Noise":
        if self.low > self.high:
            raise ValueError("low must not be above high")
        return self


class Joint(Parameters):
    name: str
    amplitude: float = Field(default=0.0, ge=0)


class RobotParameters(Parameters):
    rate_hz: float = Field(default=10.0, gt=0, le=1000, description="How often to publish.")
    count: int = 3
    enabled: bool = True
    frame: ReadOnly[str] = "imu_link"
    mode: Mode = Mode.FAST
    level: Level = Level.LOW
    side: Literal["left", "right", 1] = "left"
    offset: tuple[float, float] = (0.0, 0.0)
    calibration: Path = Path("calibration.yaml")
    noise: Noise = Noise()
    joints: tuple[Joint, ...] = ()
    limit: float | None = None
    model_path: str = ""


def fault(data: dict[str, object]) -> Fault:
    with pytest.raises(InvalidParameter) as caught:
        validate(RobotParameters, data)
    (only,) = caught.value.faults
    return only


@pytest.mark.parametrize(
    ("data", "expected"),
    [
        ({"rate_hz": 5}, 5.0),
        ({"limit": 2**60}, 2.0**60),
        ({"rate_hz": np.float32(0.5)}, 0.5),
        ({"rate_hz": np.int64(5)}, 5.0),
        ({"count": np.uint8(7)}, 7),
        ({"enabled": np.bool_(False)}, False),
        ({"mode": "slow"}, Mode.SLOW),
        ({"mode": Mode.SLOW}, Mode.SLOW),
        ({"level": 2}, Level.HIGH),
        ({"side": "right"}, "right"),
        ({"side": 1}, 1),
        ({"offset": [1, 2.5]}, (1.0, 2.5)),
        ({"calibration": "a/b.yaml"}, Path("a/b.yaml")),
        ({"noise": {"imu": 0.5}}, Noise(imu=0.5)),
        ({"joints": [{"name": "knee"}]}, (Joint(name="knee"),)),
        ({"limit": None}, None),
        ({"limit": math.inf}, math.inf),
        ({"model_path": "m.onnx"}, "m.onnx"),
    ],
)
def test_a_value_of_the_declared_type_is_taken(data: dict[str, object], expected: object):
    (name,) = data
    value = getattr(validate(RobotParameters, data), name)
    assert value == expected
    assert type(value) is type(expected)


def test_nan_is_accepted_without_a_declared_range():
    assert math.isnan(validate(RobotParameters, {"noise": {"high": math.nan}}).noise.high)


@pytest.mark.parametrize(
    ("data", "message", "fix"),
    [
        ({"rate_hz": "50"}, "rate_hz must be a number, got text '50'", "remove the quotes"),
        ({"rate_hz": "nan"}, "rate_hz must be a number, got text 'nan'", "write .nan"),
        ({"rate_hz": "-Infinity"}, "rate_hz must be a number, got text '-Infinity'", "write -.inf"),
        ({"rate_hz": "1_000"}, "rate_hz must be a number, got text '1_000'", "write 1000"),
        ({"count": "nan"}, "count must be a whole number, got text 'nan'", None),
        ({"rate_hz": "fast"}, "rate_hz must be a number, got text 'fast'", None),
        ({"rate_hz": True}, "rate_hz must be a number, got true", None),
        ({"rate_hz": [1]}, "rate_hz must be a number, got a list", None),
        ({"rate_hz": None}, "rate_hz must be a number, got null", None),
        ({"rate_hz": 0}, "rate_hz must be greater than 0, got 0", "allowed: greater than 0, at most 1000"),
        (
            {"rate_hz": math.nan},
            "rate_hz must be at most 1000, got .nan",
            "allowed: greater than 0, at most 1000",
        ),
        (
            {"rate_hz": math.inf},
            "rate_hz must be at most 1000, got .inf",
            "allowed: greater than 0, at most 1000",
        ),
        ({"rate_hz": 10**400}, "rate_hz must be a number, got a number of more than 20 digits", None),
        (
            {"limit": 2**53 + 1},
            "limit: no float is 9007199254740993; write the nearest, 9007199254740992.0, or make it a whole number",
            None,
        ),
        (
            {"limit": 2 * 10**21 + 1},
            "limit: no float is 2000000000000000000001; write the nearest, 2e+21, or make it a whole number",
            None,
        ),
        ({"count": "10"}, "count must be a whole number, got text '10'", "remove the quotes"),
        ({"count": 10.0}, "count must be a whole number, got 10.0", "write 10"),
        ({"count": 10.5}, "count must be a whole number, got 10.5", None),
        ({"count": True}, "count must be a whole number, got true", None),
        ({"enabled": 1}, "enabled must be true or false, got 1", None),
        ({"enabled": "yes"}, "enabled must be true or false, got text 'yes'", "write true"),
        ({"enabled": "Off"}, "enabled must be true or false, got text 'Off'", "write false"),
        ({"frame": 12}, "frame must be text, got 12", 'quote it: "12"'),
        ({"frame": True}, "frame must be text, got true", 'quote it: "true"'),
        ({"mode": "fats"}, "mode must be one of fast, slow, got text 'fats'", "did you mean 'fast'?"),
        ({"level": True}, "level must be one of 1, 2, got true", None),
        ({"level": 1.0}, "level must be one of 1, 2, got 1.0", None),
        ({"side": True}, "side must be one of left, right, 1, got true", None),
        ({"side": "up"}, "side must be one of left, right, 1, got text 'up'", "known: 1, left, right"),
        ({"offset": 5}, "offset must be a list[float], got 5", None),
        ({"offset": [1]}, "offset must have 2 items", None),
        ({"offset": [1, 2, 3]}, "offset must have at most 2 items, has 3", None),
        ({"offset": [1, "2"]}, "offset[1] must be a number, got text '2'", "remove the quotes"),
        ({"calibration": 5}, "calibration must be a path, got 5", None),
        ({"noise": 0.5}, "noise must be a mapping, got 0.5", None),
        ({"noise": {"imu": -1}}, "noise.imu must be at least 0, got -1", "allowed: at least 0, at most 10"),
        ({"noise": {"imuu": 1}}, "unknown parameter noise.imuu", "did you mean 'imu'?"),
        ({"noise": {"low": 3}}, "noise: low must not be above high", None),
        ({"joints": [{}]}, "parameter joints[0].name is required", "add `name:` with a value (str)"),
        ({"limit": "x"}, "limit must be a number or null, got text 'x'", None),
        ({"rate_hzz": 1}, "unknown parameter rate_hzz", "did you mean 'rate_hz'?"),
    ],
)
def test_a_fault_says_what_why_and_remedy(data: dict[str, object], message: str, fix: str | None):
    found = fault(data)
    assert (found.message, found.fix) == (message, fix)


def test_all_faults_come_at_once_with_their_paths(golden):
    with pytest.raises(InvalidParameter) as caught:
        validate(RobotParameters, {"rate_hz": -1, "noise": {"imu": "x"}, "joints": [{"name": "a"}, {"nam": "b"}]})
    assert {(each.path, each.code) for each in caught.value.faults} == {
        (("rate_hz",), "range"),
        (("noise", "imu"), "type"),
        (("joints", 1, "name"), "missing"),
        (("joints", 1, "nam"), "unknown"),
    }
    golden(str(caught.value))


def test_errors_about_hostile_text_are_one_printable_line():
    with pytest.raises(InvalidParameter) as caught:
        validate(RobotParameters, {"\x1b[31m": 1, "rate_hz": "\x1b]0;x\x07\n"})
    assert str(caught.value).isprintable()


def test_wrong_default_is_an_error_of_its_class(golden):
    class Wrong(Parameters):
        rate_hz: float = Field(default=-1.0, gt=0)
        name: str

    with golden.raises(InvalidDeclaration) as caught:
        validate(Wrong, {})
    assert caught.value.place is not None
    assert caught.value.place.excerpt == "    class Wrong(Parameters):"
    with golden.raises(InvalidParameter):
        validate(Wrong, {"rate_hz": 1})
    with golden.raises(InvalidParameter):
        validate(Wrong, {"rate_hz": -2, "name": "x"})


def test_a_wrong_default_without_source_is_named(golden):
    wrong = create_model("Wrong", __base__=Parameters, rate_hz=(float, "fast"))
    with golden.raises(InvalidDeclaration) as caught:
        validate(wrong, {})
    assert caught.value.place is None


def test_parameters_cannot_be_changed_in_place():
    parameters = validate(RobotParameters, {})
    with pytest.raises(InvalidParameter):
        parameters.rate_hz = 5.0  # type: ignore[misc]  # that is the point


def test_python_values_are_checked_like_a_file_s():
    assert RobotParameters(rate_hz=50).rate_hz == 50.0
    with pytest.raises(ValidationError):
        RobotParameters(count="3")  # type: ignore[arg-type]  # that is the point


def test_describe_lists_every_parameter_with_its_dotted_name():
    rows = {row.name: row for row in describe(RobotParameters)}
    assert list(rows)[:4] == ["rate_hz", "count", "enabled", "frame"]
    rate = rows["rate_hz"]
    assert (rate.type, rate.default, rate.required, rate.description) == (
        "float",
        10.0,
        False,
        "How often to publish.",
    )
    assert (rate.bounds.minimum, rate.bounds.exclusive_minimum, rate.bounds.maximum) == (0, True, 1000)
    assert rows["noise.imu"].default == 0.1
    assert rows["mode"].choices == ("fast", "slow")
    assert rows["mode"].default == "fast"
    assert rows["frame"].read_only
    assert not rows["count"].read_only
    assert rows["offset"].type == "list[float]"
    assert rows["limit"].type == "float or null"
    assert {row.name for row in describe(Joint) if row.required} == {"name"}


def test_describe_shows_the_outer_default_of_nested_parameters():
    class Quiet(Parameters):
        noise: Noise = Noise(imu=0.0)

    assert describe(Quiet)[0].default == 0.0


def test_grouped_values_make_the_same_parameters():
    parameters = validate(RobotParameters, {"count": 3, "noise": {"imu": 0.5}})
    values = {row.name: value_of(parameters, row.name) for row in describe(RobotParameters)}
    assert validate(RobotParameters, grouped(values)) == parameters


def test_the_schema_has_ranges_choices_and_read_only():
    schema = RobotParameters.model_json_schema()
    assert schema["properties"]["rate_hz"]["exclusiveMinimum"] == 0
    assert schema["properties"]["frame"]["readOnly"] is True
    assert schema["additionalProperties"] is False


@given(st.one_of(st.booleans(), st.integers(), st.floats(), st.text(), st.none(), st.lists(st.integers())))
def test_a_scalar_is_never_converted_into_another_type(value: object):
    wanted = {"count": int, "enabled": bool, "frame": str, "limit": (int, float, type(None))}
    for name, types in wanted.items():
        fits = isinstance(value, types) and not (isinstance(value, bool) and types is not bool)
        if fits and isinstance(value, int) and name == "limit":
            fits = value.bit_length() < 1024 and float(value) == value  # others have no float of their value
        if fits:
            result = getattr(validate(RobotParameters, {name: value}), name)
            assert result == value or (result != result and value != value)
        else:
            assert fault({name: value}).path == (name,)


@each_case("f_parameters", "range/")
def test_ranges_agree_with_rclpy(case: dict[str, dict[str, object]]):
    given, kind = case["input"], {"float": float, "int": int}[str(case["input"]["range"])]
    bounds = Field(ge=given["from"], le=given["to"], multiple_of=given["step"] or None)  # type: ignore[arg-type]  # plain data
    model = create_model("Ranged", __base__=Parameters, value=(kind, bounds))
    if case["expect"]["ok"]:
        assert validate(model, {"value": given["value"]})
    else:
        with pytest.raises(InvalidParameter):
            validate(model, {"value": given["value"]})


@pytest.mark.skipif(tuple(map(int, version_short().split("."))) < (2, 14), reason="pydantic refuses it first")
def test_parameter_without_annotation_is_refused_with_advice(golden):
    with golden.raises(InvalidDeclaration):

        class Bare(Parameters):
            rate_hz = 10


def test_an_assigned_parameter_is_refused_with_advice(golden):
    class Sensor(Parameters):
        a: int = 1

    sensor = Sensor()
    with golden.raises(InvalidParameter):
        sensor.a = 2
    with golden.raises(InvalidParameter):
        sensor.b = 2
    assert sensor == Sensor(a=1)
    sensor._cache = 2
    assert sensor._cache == 2
