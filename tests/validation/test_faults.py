"""Tests of `faults.py`: pydantic's errors as faults, for shapes that parameters alone do not cover."""

from typing import Annotated, Literal

import pytest
from pydantic import Field

from busflow.errors import Fault, InvalidParameter
from busflow.node.parameters import Parameters, validate
from busflow.validation.faults import plain, shown


class Circle(Parameters):
    kind: Literal["circle"] = "circle"
    radius: float = Field(default=1.0, gt=0)


class Square(Parameters):
    kind: Literal["square"] = "square"
    side: float = 1.0


class Shapes(Parameters):
    either: int | str = 1
    several: list[float] | float = 1.0
    shape: Circle | Square = Circle()
    tagged: Annotated[Circle | Square, Field(discriminator="kind")] = Circle()
    code: str = Field(default="ab", pattern="^[a-z]+$", max_length=3)
    table: dict[str, Annotated[float, Field(ge=0)]] = Field(default_factory=dict)
    few: list[int] = Field(default=[1], min_length=1)
    finite: float = Field(default=0.0, allow_inf_nan=False)
    optional: Annotated[float, Field(gt=0)] | None = None


@pytest.mark.parametrize(
    ("data", "path", "message"),
    [
        ({"either": 1.5}, ("either",), "either must be a whole number or text, got 1.5"),
        ({"several": ["x"]}, ("several",), "several must be a list[float] or a number, got a list"),
        ({"shape": {"kind": "oval"}}, ("shape",), "shape must be Circle or Square, got a mapping"),
        (
            {"tagged": {"kind": "oval"}},
            ("tagged", "kind"),
            "tagged.kind must be one of 'circle', 'square', got text 'oval'",
        ),
        (
            {"tagged": {"kind": "square", "side": "2"}},
            ("tagged", "side"),
            "tagged.side must be a number, got text '2'",
        ),
        (
            {"tagged": {"kind": "circle", "raduis": 2}},
            ("tagged", "raduis"),
            "unknown parameter tagged.raduis",
        ),
        ({"code": "A1"}, ("code",), "code must match the pattern ^[a-z]+$, got text 'A1'"),
        ({"code": "abcd"}, ("code",), "code must have at most 3 characters, has 4"),
        ({"table": {"a": -1}}, ("table", "a"), "table.a must be at least 0, got -1"),
        ({"few": []}, ("few",), "few must have at least 1 item, has 0"),
        ({"finite": float("inf")}, ("finite",), "finite must be a finite number, got .inf"),
        ({"optional": -1}, ("optional",), "optional must be greater than 0, got -1"),
    ],
)
def test_each_fault_has_the_path_of_the_data(data: dict[str, object], path: tuple[str | int, ...], message: str):
    with pytest.raises(InvalidParameter) as caught:
        validate(Shapes, data)
    assert [(each.path, each.message) for each in caught.value.faults] == [(path, message)]


class Noise(Parameters):
    imu: float = 0.0


class Noisy(Parameters):
    noise: Noise = Noise()


def test_dotted_key_is_written_as_a_mapping():
    with pytest.raises(InvalidParameter) as caught:
        validate(Noisy, {"noise.imu": 0.3, "noise.ium": 0.3})
    assert [each.fix for each in caught.value.faults] == ["write noise: {imu: …}", "did you mean 'noise'?"]


def test_a_long_text_is_cut_in_an_error():
    assert len(shown("x" * 1000)) < 80


def test_plain_data_has_only_builtin_types():
    assert plain(Shapes()) == {
        "either": 1,
        "several": 1.0,
        "shape": {"kind": "circle", "radius": 1.0},
        "tagged": {"kind": "circle", "radius": 1.0},
        "code": "ab",
        "table": {},
        "few": [1],
        "finite": 0.0,
        "optional": None,
    }


def test_faults_are_values():
    assert Fault(("a",), "b") == Fault(("a",), "b")
