"""Values that are typed for a message: what fits, and where it does not."""

import pytest

from busflow.cli.terminal.field_paths import shape_of
from busflow.cli.topic.typed_values import TypedValues
from busflow.errors import InvalidInput, LaunchError
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.msgs.geometry_msgs import PoseArray
from busflow.msgs.std_msgs import Float64, String


def typed(text, cls=Float64):
    support = TypeSupport(cls)
    type_ = ForeignType(support.name, support.type_hash, support.description)
    return TypedValues(text, type_, shape_of(type_))


@pytest.mark.parametrize(
    ("text", "values"), [("{data: 1}", {"data": 1}), ("data: 2.5", {"data": 2.5}), ("", {}), ("  ", {})]
)
def test_values_are_yaml(text, values):
    assert typed(text).at(0) == values


def test_header_and_time_are_filled_per_message():
    values = typed("{header: auto}", PoseArray)
    assert values.at(3_000_000_007) == {"header": {"stamp": {"sec": 3, "nanosec": 7}}}
    assert values.at(4_000_000_000)["header"]["stamp"]["sec"] == 4
    stamp = typed("{header: {stamp: now, frame_id: now}}", PoseArray).at(5_000_000_000)
    assert stamp == {"header": {"stamp": {"sec": 5, "nanosec": 0}, "frame_id": "now"}}


@pytest.mark.parametrize(
    ("text", "cls", "column"),
    [
        ("{data: oops}", Float64, 8),
        ("{value: 1.0}", Float64, 2),
        ("1.0", Float64, 1),
        ("data:1.0", Float64, 1),
        ("[1]", Float64, 1),
        ("{data: 5}", String, 8),
        ("{poses: [{}, {position: {x: a}}]}", PoseArray, 29),
        ("{poses: [{positoin: {}}]}", PoseArray, 11),
    ],
)
def test_unfit_values_are_shown(text, cls, column, golden):
    with golden.raises(InvalidInput) as caught:
        typed(text, cls)
    assert (caught.value.code, caught.value.problem.place.column) == ("values", column)


@pytest.mark.parametrize("text", ["{data: 1.0", "{data: *a}", "{data: !!python/name:os.x y}", "{data: 1, data: 2}"])
def test_only_plain_data_is_accepted(text):
    with pytest.raises(LaunchError):
        typed(text)
