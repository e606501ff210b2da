"""The words for the types of fields; pyright checks the files in tests/typing."""

from busflow.interfaces import field_types as aliases
from busflow.interfaces.fields import PRIMITIVES


def test_each_ros_type_has_a_word():
    scalars = {name for name in aliases.__all__ if name.islower()}
    arrays = {name.removesuffix("Array").lower() for name in aliases.__all__ if name.endswith("Array")}
    assert scalars == set(PRIMITIVES) - {"bool"}
    assert arrays == {name for name, primitive in PRIMITIVES.items() if primitive.dtype}
