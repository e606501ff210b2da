"""Abridging of long sequences and texts."""

import pytest

from busflow.cli.terminal.abridged import Abridger
from busflow.cli.terminal.field_paths import shape_of
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.rcl_interfaces import ParameterDescriptor
from busflow.msgs.sensor_msgs import Imu, JointState


def foreign(cls):
    support = TypeSupport(cls)
    return ForeignType(support.name, support.type_hash, support.description)


def test_sequences_and_texts_are_cut_at_every_level():
    value = {"a": {"b": (("x" * 9), "y")}, "n": memoryview(bytes(200))}
    assert Abridger(3)(value) == {"a": {"b": ["xxx...", "y"]}, "n": [0, 0, 0, "..."]}
    assert Abridger(1)({"a": ("x", "y")}) == {"a": ["x", "..."]}
    assert Abridger()(value)["n"] == [0] * 128 + ["..."]
    assert Abridger(None)(value)["n"] == [0] * 200


@pytest.mark.parametrize(
    ("cls", "field", "text"),
    [
        (JointState, "name", "<sequence type: string, length: 0>"),
        (JointState, "effort", "<sequence type: double, length: 0>"),
        (Imu, "orientation_covariance", "<array type: double[9]>"),
        (ParameterDescriptor, "integer_range", "<sequence type: rcl_interfaces/msg/IntegerRange[1], length: 0>"),
    ],
)
def test_omitted_sequence_shows_its_type_as_ros2(cls, field, text):
    type_ = foreign(cls)
    value = type_.decode(type_.encode({}))
    assert Abridger(no_arrays=True)(value, shape_of(type_))[field] == text


def test_without_a_shape_only_the_length_is_known():
    assert Abridger(no_arrays=True)({"a": [1, 2]}) == {"a": "<sequence length: 2>"}
    assert Abridger(no_texts=True)({"a": "abc"}) == {"a": "<string length: <3>>"}
