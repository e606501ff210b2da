"""Values of sequences: elements are Python's, as in rclpy; whole arrays are numpy's; they compare as sequences do."""

import copy
import json
import pickle
from array import array as machine_array
from collections.abc import Sequence
from operator import add
from typing import Annotated

import numpy as np
import pytest
from pydantic import create_model

from busflow import Length, Message
from busflow.interfaces import message as words
from busflow.interfaces.arrays import is_frozen
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Float64Array, Int8Array, take, zeros
from busflow.interfaces.sequences import FieldArray
from busflow.msgs.geometry_msgs import Point
from busflow.msgs.nav_msgs import OccupancyGrid, Path
from busflow.msgs.sensor_msgs import Image, Imu, JointState

NUMBERS = ["Float32", "Float64", "Int8", "Int16", "Int32", "Int64", "UInt8", "UInt16", "UInt32", "UInt64", "Bool"]


Numbers = create_model(
    "Numbers", __base__=Message, **{name.lower(): (getattr(words, f"{name}Array"), zeros()) for name in NUMBERS}
)
"""A message with an array of each type."""


class Several(Message, package="tests"):
    """Sequences of exact and of bounded lengths."""

    fixed: Annotated[Float64Array, Length(3)] = zeros(3)
    few: Annotated[Int8Array, Length(max=3)] = zeros()
    points: Sequence[Point] = ()
    pair: Annotated[Sequence[str], Length(2)] = ("a", "b")


def sent(message):
    """Return the message and the same one as another process gets it, in both byte orders."""
    support = TypeSupport(type(message))
    return [message, support.decode(support.encode(message)), type(message).model_validate(message.model_dump())]


@pytest.mark.parametrize("name", NUMBERS)
def test_an_element_is_a_python_number_however_it_is_read(name):
    wanted = {"F": float, "B": bool}.get(name[0], int)
    values = [wanted(each) for each in (1, 0, 1)]
    for message in sent(Numbers(**{name.lower(): values})):
        array = getattr(message, name.lower())
        assert isinstance(array, np.ndarray)
        ways = [
            [array[0], array[1], array[-1]],
            list(array),
            [*array[:2], array[1:][1]],
            [*reversed(array)],
            [each for _, each in enumerate(array)],
            [each for each, _ in zip(array, array, strict=True)],
            sorted(array, reverse=True),
            [min(array), max(array)],
            array.tolist(),
            [*array.copy(), *array[::2], *array.view(), *array.reshape(3, 1)[0], array.reshape(3, 1)[2, 0]],
            [*copy.deepcopy(array), *pickle.loads(pickle.dumps(array))],  # noqa: S301 - made here
            [array.item(0), *map(wanted, array)],
        ]
        for read in ways:
            assert {type(each) for each in read} == {wanted}, read
        assert ways[1] == values
        assert 1 in array
        assert json.dumps(list(array)) == json.dumps(values)
        assert f"{array[0]} {array[0]!r}" == f"{values[0]} {values[0]}"


def test_arithmetic_of_an_element_does_not_overflow():
    for grid in sent(OccupancyGrid(data=[100])):
        assert grid.data[0] * 2 == 200
        assert sum(each * 2 for each in grid.data) == 200
    for image in sent(Image(data=b"\xfa\x0a")):
        assert (image.data[0] + image.data[1] + 10) // 3 == 90
        first, second = image.data
        assert (first - second, second - first) == (240, -240)


def test_arithmetic_of_whole_arrays_is_numpy_s():
    data = OccupancyGrid(data=[100, -1, 50]).data
    for result in (data * 2, data + data, -data, np.abs(data), data > 0, np.where(data > 0, data, 0), np.diff(data)):
        assert type(result) is np.ndarray
    assert (data * 2).tolist() == [-56, -2, 100]
    assert type((data * 2)[0]) is np.int8
    assert type(data.sum(dtype=np.int64)) is np.int64
    assert type(data.max()) is np.int8
    assert type(data.mean()) is np.float64
    assert np.array_equal(data, [100, -1, 50])
    assert type(np.asarray(data)) is np.ndarray
    assert np.shares_memory(np.asarray(data), data)


def test_views_and_copies_stay_arrays_of_a_field():
    data = take(np.arange(6, dtype=np.uint8))
    for view in (data[1:], data[::-1], data.reshape(2, 3), data.view(np.int8), data[data > 2], data[[0, 2]]):
        assert type(view) is FieldArray
    (first, *_), second = data.reshape(2, 3)
    assert (first, [*second], data.reshape(2, 3)[..., 1].tolist()) == (0, [3, 4, 5], [1, 4])
    assert type(data[:1].reshape(())[()]) is int
    assert not data[:1].reshape(())
    copied = data.copy()
    copied[0] = 9
    copied += 1
    assert type(copied) is FieldArray
    assert copied.tolist() == [10, 2, 3, 4, 5, 6]
    assert data[0] == 0


def test_records_and_other_types_are_read_as_numpy_reads_them():
    cloud = take(np.arange(3, dtype=np.float32).view(np.uint8))
    points = cloud.view([("x", "f4")])
    assert type(points[1]) is np.void
    assert [*points["x"]] == [0.0, 1.0, 2.0]
    assert type(points["x"][1]) is float
    swapped = np.array([1, 2], ">i4").view(FieldArray)
    half = np.array([1, 2], np.float16).view(FieldArray)
    assert [type(each) for each in (*swapped, *half)] == [int, int, float, float]


def test_read_only_views_of_a_field_are_taken_without_a_copy():
    data = Image(data=b"ab").data
    plain = np.asarray(data)
    assert is_frozen(plain)
    assert not is_frozen(plain.copy())
    assert np.shares_memory(Image(data=plain).data, data)
    memory = bytearray(b"ab")
    borrowed = np.frombuffer(memory, np.uint8)
    borrowed.flags.writeable = False
    taken = Image(data=borrowed).data
    memory[0] = 0
    assert taken == b"ab"


def test_received_bytes_are_not_copied():
    payload = TypeSupport(Image).encode(Image(data=bytes(range(250))))
    data = TypeSupport(Image).decode(payload).data
    assert data.base is payload
    assert type(data) is FieldArray


def test_a_small_array_that_stays_the_same_is_one_object():
    support = TypeSupport(Imu)
    encoded = [support.encode(Imu(orientation_covariance=[value] * 9)) for value in (1.0, 1.0, 2.0)]
    first, second, third = [support.decode(each).orientation_covariance for each in encoded]
    assert first is second
    assert (first.tolist(), third.tolist()) == ([1.0] * 9, [2.0] * 9)


def test_sequences_compare_as_in_python():
    for joints in sent(JointState(name=["hip", "knee"], position=[1.0, 2.0])):
        for same in ([1.0, 2.0], (1, 2), np.array([1.0, 2.0]), machine_array("d", [1, 2]), joints.position):
            assert joints.position == same
            assert bool(joints.position != same) is False
            assert (joints.position == same).all()
        for other in ([1.0, 2.5], [1.0], [], (1.0, 2.0, 3.0), np.zeros(2), joints.velocity, joints.position[:1]):
            assert joints.position != other
            assert bool(joints.position == other) is False
        assert joints.position == [1.0, 2.0]
        assert joints.position == pytest.approx([1.0, 2.0])
        for same in (["hip", "knee"], ("hip", "knee"), joints.name[:], list(joints.name)):
            assert joints.name == same
            assert bool(joints.name != same) is False
        assert joints.name != ["hip"]
        assert joints.name != ["hip"]
        assert joints.name[:1] == ["hip"]
    assert JointState().position == []
    assert JointState(position=[1.0]).position != []
    assert JointState(position=[1.0]).position != [1.0, 1.0]
    assert Path().poses == []
    assert Several(points=[Point(x=1)]).points == [Point(x=1)]
    for several in sent(Several(few=[1], fixed=[1, 2, 3])):
        assert several.pair == ["a", "b"]
        assert (several.few, several.fixed) == ([1], [1, 2, 3])
        assert {*map(type, several.few), *map(type, several.fixed)} == {int, float}
    assert Image(data=b"ab").data == b"ab" == Image(data=b"ab").data == bytearray(b"ab")
    assert Image(data=b"ab").data != b"abc"


def test_comparison_stays_element_by_element():
    data = OccupancyGrid(data=[1, 2, 1]).data
    assert (data == 1).tolist() == [True, False, True]
    assert type(data == 1) is np.ndarray
    result = data == [1, 1, 1]
    assert repr(result) == "array([ True, False,  True])"
    assert result.sum() == 2
    assert type(~result) is np.ndarray
    assert data[result].tolist() == [1, 1]
    with pytest.raises(ValueError, match="ambiguous"):
        bool(result[1:])
    with pytest.raises(ValueError, match="ambiguous"):
        bool(data == 1)
    assert (data.reshape(3, 1) == [[1], [2], [1]]).all()
    assert (data == np.array([[1, 2, 1]])).shape == (1, 3)


def test_an_array_is_true_if_it_has_elements():
    assert JointState(position=[0.0]).position
    assert JointState(position=[0.0, 0.0]).position
    assert not JointState().position
    assert not JointState().name
    with pytest.raises(ValueError, match="ambiguous"):
        bool(JointState(position=[0.0, 0.0]).position.reshape(1, 2))


def test_a_tuple_of_texts_is_joined_with_a_list():
    names = JointState(name=["hip"]).name
    assert add(names, ["knee"]) == ["hip", "knee"]
    assert add(["knee"], names) == ["knee", "hip"]
    assert add(names, ("knee",)) == ("hip", "knee")
    with pytest.raises(TypeError):
        add(5, names)
    assert hash(names) == hash(("hip",))
    assert copy.deepcopy(names) == pickle.loads(pickle.dumps(names)) == ["hip"]  # noqa: S301 - made here
    assert repr(names) == "('hip',)"


@pytest.mark.parametrize("field", ["name", "position"])
def test_a_method_that_changes_a_list_says_what_to_write(field, golden):
    value = getattr(JointState(), field)
    with pytest.raises(AttributeError) as caught:
        value.append(1)
    golden(str(caught.value))
    assert not hasattr(value, "extend")


BYTES = ([1, 2], (1, 2), range(1, 3), machine_array("b", [1, 2]), b"\1\2", bytearray(b"\1\2"), np.array([1, 2]))


@pytest.mark.parametrize("values", BYTES, ids=lambda each: type(each).__name__)
def test_bytes_are_given_as_in_rclpy(values):
    assert Image(data=values).data == [1, 2]


def test_a_message_takes_the_fields_of_another():
    first = JointState(name=["hip"], position=[1.0])
    second = JointState(name=first.name, position=first.position, velocity=[*first.position, 2.0])
    assert second.name is first.name
    assert second.position is first.position
    assert first.replace(name=add(first.name, ["knee"])).name == ["hip", "knee"]
