"""Paths into messages: parsing, checking against a type, and values at a path."""

from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.cli.terminal.field_paths import Absent, Shape, parse_path, value_at
from busflow.errors import InvalidInput
from busflow.interfaces.encoding.description import Count
from tests.golden import Golden

POINT = Shape("g/msg/Point", {"x": Shape("float64")})
CLOUD = Shape(
    "g/msg/Cloud",
    {
        "points": Shape("g/msg/Point", POINT.fields, Count.UNBOUNDED),
        "name": Shape("string"),
        "spread": Shape("float64", None, Count.FIXED, 9),
        "few": Shape("float64", None, Count.BOUNDED, 3),
    },
)


@pytest.mark.parametrize(
    ("text", "path"),
    [
        ("name", ("name",)),
        ("points[0].x", ("points", 0, "x")),
        ("points[-1]", ("points", -1)),
        ("points[99]", ("points", 99)),
        ("spread[-9]", ("spread", -9)),
        ("few[2]", ("few", 2)),
    ],
)
def test_a_path_is_read(text: str, path: tuple[str | int, ...]):
    assert parse_path(text, "--field", CLOUD) == path


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("nme", 1),
        ("points.x", 8),
        ("points[0].y", 11),
        ("name.x", 6),
        ("name[0]", 5),
        ("", 1),
        ("name.", 6),
        ("[0]", 1),
        ("points..x", 8),
        ("points[0]x", 10),
        ("points[99999999999]", 7),
        ("spread[9]", 7),
        ("spread[-10]", 7),
        ("few[3]", 4),
    ],
)
def test_invalid_path_is_shown_with_a_caret(text: str, column: int, golden: Golden):
    with golden.raises(InvalidInput) as caught:
        parse_path(text, "--field", CLOUD)
    assert isinstance(caught.value, InvalidInput)
    place = caught.value.problem.place
    assert place is not None
    assert (caught.value.code, place.file, place.column) == ("path", "--field", column)


@given(st.text())
def test_any_text_is_a_path_or_an_error(text: str):
    with suppress(InvalidInput):
        parse_path(text, "--field")


@pytest.mark.parametrize("path", [("a", 2), ("a", -3), ("b",), ("a", 0, "x"), ("t", 0)])
def test_missing_value_is_absent(path: tuple[str | int, ...]):
    with pytest.raises(Absent):
        value_at(path, {"a": (1, 2), "t": "text"})
