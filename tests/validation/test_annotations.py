"""Tests of `annotations.py`: names, ranges and choices of type annotations."""

import math
from enum import Enum
from pathlib import Path
from typing import Annotated, Any, Literal

import pytest
from annotated_types import Ge, Gt, Le, Lt, MultipleOf
from pydantic import Field

from busflow.validation.annotations import Bounds, StrictModel, at, choices, split, type_word


class Colour(Enum):
    RED = "red"
    BLUE = "blue"


class Inner(StrictModel):
    size: Annotated[float, Field(gt=0)] = 1.0


class Outer(StrictModel):
    inner: Inner = Inner()
    table: dict[str, list[Inner]] = Field(default_factory=dict)
    pair: tuple[int, Annotated[str, Field(max_length=3)]] = (1, "a")
    renamed: int = Field(default=1, ge=0, alias="other")
    either: int | str = 1


@pytest.mark.parametrize(
    ("annotation", "word"),
    [
        (float, "float"),
        (Annotated[int, Field(ge=0)], "int"),
        (Path, "path"),
        (float | None, "float or null"),
        (int | float | str, "int or float or str"),
        (list[float], "list[float]"),
        (tuple[int, ...], "list[int]"),
        (tuple[float, float], "list[float]"),
        (tuple[int, str], "list[int, str]"),
        (dict[str, float], "dict[str, float]"),
        (Literal["a", "b"], "str"),
        (Literal["a", 1], "int or str"),
        (Colour, "str"),
        (list[Inner], "list[Inner]"),
    ],
)
def test_type_word_is_what_a_user_writes(annotation: Any, word: str):
    assert type_word(annotation) == word


@pytest.mark.parametrize(
    ("bounds", "text"),
    [
        (Bounds(), ""),
        (Bounds(minimum=0), "at least 0"),
        (Bounds(0, 1, exclusive_minimum=True, exclusive_maximum=True), "greater than 0, less than 1"),
        (Bounds(minimum=0.1, maximum=1e6), "at least 0.1, at most 1000000"),
        (Bounds(step=0.5), "a multiple of 0.5"),
    ],
)
def test_bounds_read_as_a_sentence(bounds: Bounds, text: str):
    assert str(bounds) == text


@pytest.mark.parametrize(
    ("path", "annotation", "bounds"),
    [
        (("inner", "size"), float, Bounds(0, exclusive_minimum=True)),
        (("table", "any", 3, "size"), float, Bounds(0, exclusive_minimum=True)),
        (("pair", 0), int, Bounds()),
        (("other",), int, Bounds(0)),
        (("renamed",), int, Bounds(0)),
        (("nothing",), None, Bounds()),
        (("either", "x"), None, Bounds()),
    ],
)
def test_path_leads_into_nested_types(path: tuple[str | int, ...], annotation: Any, bounds: Bounds):
    found, metadata = at(Outer, path)
    assert split(found)[0] is annotation
    assert Bounds.of(metadata) == bounds


def test_choices_are_plain_data():
    assert choices(Colour) == ("red", "blue")
    assert choices(Literal["a", 1]) == ("a", 1)
    assert choices(int) is None


@pytest.mark.parametrize(
    ("stated", "range_"),
    [
        ([Ge(1), Le(9), MultipleOf(2)], Bounds(2, 8, step=2)),
        ([Gt(2), Lt(8), MultipleOf(2)], Bounds(4, 6, step=2)),
        ([Ge(0), Le(0.95), MultipleOf(0.1)], Bounds(0.0, 0.9, step=0.1)),
        ([Gt(-0.3), Lt(0.3), MultipleOf(0.1)], Bounds(-0.2, 0.2, step=0.1)),
        ([Ge(1), MultipleOf(2)], Bounds(2, None, step=2)),
        ([Gt(1), Le(9)], Bounds(1, 9, exclusive_minimum=True)),
        ([Ge(-math.inf), Lt(3), MultipleOf(2)], Bounds(-math.inf, 2, step=2)),
    ],
)
def test_a_range_with_a_step_ends_at_its_outermost_multiples(stated, range_):
    assert Bounds.of(stated) == range_
