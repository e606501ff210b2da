"""Changing parameters: what is named changes, everything else keeps its value, and the whole is validated."""

from enum import Enum
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, field_validator, model_validator

from busflow import Parameters
from busflow.errors import InvalidParameter
from busflow.node.parameters import with_changes


class Mode(Enum):
    FAST = "fast"
    SLOW = "slow"


class Noise(Parameters):
    imu: float = Field(default=0.1, ge=0, le=10)
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
    rate_hz: float = Field(default=10.0, gt=0, le=1000)
    mode: Mode = Mode.FAST
    file: Path = Path("a.yaml")
    noise: Noise = Noise()
    spare: Noise | None = None
    joints: tuple[Joint, ...] = ()
    gains: dict[str, float] = Field(default_factory=dict)
    twice_hz: float = Field(default_factory=lambda data: 2 * data["rate_hz"])
    label: str = Field(default="", alias="tag")

    @field_validator("label")
    @classmethod
    def _explodes(cls, label: str) -> str:
        return str(1 / 0) if label == "boom" else label


JOINTS = (Joint(name="knee"), Joint(name="hip", amplitude=0.2))
ROBOT = RobotParameters(rate_hz=20, noise=Noise(high=5), joints=JOINTS, gains={"kp": 1.0, "kd": 0.1})


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, {}),
        ({"rate_hz": 50}, {"rate_hz": 50.0}),
        ({"mode": "slow"}, {"mode": Mode.SLOW}),
        ({"file": "b.yaml"}, {"file": Path("b.yaml")}),
        ({"noise.imu": 0.5}, {"noise": Noise(imu=0.5, high=5)}),
        ({"noise": {"imu": 0.5}}, {"noise": Noise(imu=0.5, high=5)}),
        ({"noise": {"imu": 0.5}, "noise.low": 2}, {"noise": Noise(imu=0.5, low=2, high=5)}),
        ({"noise": {}}, {}),
        ({"noise": Noise()}, {"noise": Noise()}),
        ({"noise.low": 7, "noise.high": 9}, {"noise": Noise(low=7, high=9)}),
        ({"spare": {"imu": 0.5}}, {"spare": Noise(imu=0.5)}),
        ({"spare.imu": 0.5}, {"spare": Noise(imu=0.5)}),
        ({"gains": {"ki": 2}}, {"gains": {"ki": 2.0}}),
        ({"gains.kp": 3}, {"gains": {"kp": 3.0, "kd": 0.1}}),
        ({"joints.1.amplitude": 0.3}, {"joints": (JOINTS[0], Joint(name="hip", amplitude=0.3))}),
        ({"joints": [{"name": "ankle"}]}, {"joints": (Joint(name="ankle"),)}),
        ({"label": "left"}, {"label": "left"}),
    ],
)
def test_only_named_parameters_change(changes, expected):
    before = {name: getattr(ROBOT, name) for name in RobotParameters.model_fields}
    after = with_changes(ROBOT, changes)
    assert {name: getattr(after, name) for name in RobotParameters.model_fields} == before | expected


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"rate_hz": 0}, "rate_hz must be greater than 0, got 0 (allowed: greater than 0, at most 1000)"),
        ({"rate_hz": "20"}, "rate_hz must be a number, got text '20' (remove the quotes)"),
        ({"rate_hz": None}, "rate_hz must be a number, got null"),
        ({"rate_hzz": 1}, "unknown parameter rate_hzz (did you mean 'rate_hz'?)"),
        ({"noise.imuu": 1}, "unknown parameter noise.imuu (did you mean 'imu'?)"),
        ({"noise": 1}, "noise must be a mapping, got 1"),
        ({"noise.low": 7}, "noise: low must not be above high"),
        ({"rate_hz.x": 1}, "rate_hz must be a number, got a mapping"),
        ({"joints.7.amplitude": 1}, "joints must be a list, got a mapping"),
        ({"mode": "fats"}, "mode must be one of fast, slow, got text 'fats' (did you mean 'fast'?)"),
        ({"noise.imu": 1, "noise": {"imu": 2}}, "noise.imu is given twice (give it one value)"),
        ({".".join("a" * 1000): 1}, "a is not nested that deep"),
        ({"label": "boom"}, "a validator raised ZeroDivisionError: division by zero"),
        ({"": 1}, "unknown parameter"),
        (
            {"rate_hz": 0, "mode": 5},
            "rate_hz must be greater than 0, got 0 (allowed: greater than 0, at most 1000); mode",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_every_reason(changes, said):
    with pytest.raises(InvalidParameter) as caught:
        with_changes(ROBOT, changes)
    assert str(caught.value).startswith(said)
    assert str(caught.value).isprintable()


def test_a_name_that_is_no_text_is_unknown(golden):
    with golden.raises(InvalidParameter):
        with_changes(ROBOT, {5: 1})


@given(st.dictionaries(st.sampled_from(["noise.imu", "noise.low", "rate_hz"]), st.floats(0.5, 1), max_size=3))
def test_changes_one_by_one_equal_changes_at_once(changes):
    at_once = with_changes(ROBOT, changes)
    one_by_one = ROBOT
    for name, value in changes.items():
        one_by_one = with_changes(one_by_one, {name: value})
    assert at_once == one_by_one
    assert with_changes(at_once, changes) == at_once
