"""`geometry_msgs` reads a file when one of its types is named; `test_msgs.py` compares every field with ROS 2's.

Tests of `forces.py`, `frames.py`, `polygons.py`, `poses.py`, `vectors.py` and `velocities.py`.
"""

import pytest

from busflow.msgs import geometry_msgs
from tests.new_interpreter import files_imported_for


def test_a_type_imports_only_files_that_it_needs():
    found = files_imported_for("geometry_msgs", "Vector3", "TransformStamped", "Polygon")
    assert found == ["geometry_msgs.vectors std_msgs.header", "geometry_msgs.frames", "geometry_msgs.polygons"]


def test_a_wrong_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="Nothing"):
        _ = geometry_msgs.Nothing
    assert {*geometry_msgs.__all__} <= {*dir(geometry_msgs)}
