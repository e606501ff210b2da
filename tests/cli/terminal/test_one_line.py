"""Messages on one line, as CSV and as Python code."""

import csv

from hypothesis import given
from hypothesis import strategies as st

from busflow.cli.terminal.field_paths import Shape
from busflow.cli.terminal.one_line import csv_line, python_form
from busflow.interfaces.encoding.description import Count
from busflow.text import UNSAFE

POINT = Shape("g/msg/Point", {"x": Shape("float64")})


@given(st.lists(st.text(st.characters(exclude_categories=["Cc", "Cf", "Zl", "Zp", "Cs"])), min_size=2))
def test_a_spreadsheet_reads_the_columns_back(texts: list[str]):
    (row,) = csv.reader([csv_line({"texts": texts})])
    assert row == texts


def test_nothing_steers_the_terminal():
    assert csv_line(["\x1b[31m\nx"]) == r'"\x1b[31m\nx"'
    assert not UNSAFE.search(python_form({"x": "\x1b\u202e"}, POINT))


def test_a_message_is_shown_as_python_code():
    points = Shape("g/msg/Point", POINT.fields, Count.UNBOUNDED)
    cloud = Shape("g/msg/Cloud", {"points": points, "name": Shape("string")})
    text = python_form({"points": [{"x": 1.0}], "name": "a"}, cloud)
    assert text == "g.msg.Cloud(points=[g.msg.Point(x=1.0)], name='a')"
    assert python_form({"a": [1, None]}, None) == "{'a': [1, None]}"
