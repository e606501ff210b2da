"""`std_msgs` reads a file when one of its types is named; `test_msgs.py` compares every field with ROS 2's.

Tests of `arrays.py`, `header.py` and `values.py`.
"""

import pytest

from busflow.msgs import std_msgs
from tests.new_interpreter import files_imported_for


def test_a_type_imports_only_files_that_it_needs():
    found = files_imported_for("std_msgs", "Header", "Float64", "Float64MultiArray")
    assert found == ["std_msgs.header", "std_msgs.values", "std_msgs.arrays"]


def test_a_wrong_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="Nothing"):
        _ = std_msgs.Nothing
    assert {*std_msgs.__all__} <= {*dir(std_msgs)}
