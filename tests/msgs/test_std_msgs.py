"""`std_msgs` reads a file when one of its types is named; `test_msgs.py` compares every field with ROS 2's.

Tests of `arrays.py`, `header.py` and `values.py`.
"""

import pytest

from busflow.msgs import std_msgs
from tests.new_interpreter import printed_by


@pytest.mark.parametrize(
    ("name", "files"),
    [
        ("Header", {"std_msgs.header"}),
        ("Float64", {"std_msgs.values"}),
        ("Float64MultiArray", {"std_msgs.arrays"}),
    ],
)
def test_a_type_imports_only_files_that_it_needs(name, files):
    code = (
        f"import sys; from busflow.msgs.std_msgs import {name}; print(*(m for m in sys.modules if m.count('.') == 3))"
    )
    assert {each.removeprefix("busflow.msgs.") for each in printed_by(code).split() if ".msgs." in each} == files


def test_a_wrong_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="Nothing"):
        _ = std_msgs.Nothing
    assert {*std_msgs.__all__} <= {*dir(std_msgs)}
