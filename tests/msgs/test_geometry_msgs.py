"""`geometry_msgs` reads a file when one of its types is named; `test_msgs.py` compares every field with ROS 2's.

Tests of `forces.py`, `frames.py`, `polygons.py`, `poses.py`, `vectors.py` and `velocities.py`.
"""

import pytest

from busflow.msgs import geometry_msgs
from tests.new_interpreter import printed_by


@pytest.mark.parametrize(
    ("name", "files"),
    [
        ("Vector3", {"geometry_msgs.vectors", "std_msgs.header"}),
        ("TransformStamped", {"geometry_msgs.frames", "geometry_msgs.vectors", "std_msgs.header"}),
        ("Polygon", {"geometry_msgs.polygons", "geometry_msgs.vectors", "std_msgs.header"}),
    ],
)
def test_a_type_imports_only_files_that_it_needs(name, files):
    read = "print(*(each for each in sys.modules if each.count('.') == 3))"
    code = f"import sys; from busflow.msgs.geometry_msgs import {name}; {read}"
    assert {each.removeprefix("busflow.msgs.") for each in printed_by(code).split() if ".msgs." in each} == files


def test_a_wrong_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="Nothing"):
        _ = geometry_msgs.Nothing
    assert {*geometry_msgs.__all__} <= {*dir(geometry_msgs)}
