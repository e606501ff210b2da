"""Arrays of a message: what is taken for one, that it is copied at most once, and that nobody can write to it."""

import math
import re
from array import array as machine_array

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst
from pydantic_core import PydanticCustomError

from busflow.interfaces.arrays import array, checker, frozen, is_frozen, same, take, zeros
from busflow.interfaces.sequences import FieldArray

INTEGERS = ["int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"]
FLOATS = ["float32", "float64"]


def shown(value):
    """A parameter's name that is the same in every process: no addresses, no positions in memory."""
    return re.sub(r" at 0x[0-9a-f]+|_iterator object", "", repr(value))


def check(dtype, value, **limits):
    bounds = np.iinfo(dtype) if dtype in INTEGERS else None
    low, high = (bounds.min, bounds.max) if bounds else (0, 0)
    return checker(dtype, low=int(low), high=int(high), **limits)(value)


def refuse(dtype, value, **limits):
    with pytest.raises(PydanticCustomError) as caught:
        check(dtype, value, **limits)
    return str(caught.value)


def assert_nobody_can_write(value):
    with pytest.raises(ValueError, match="read-only"):
        value[...] = 1
    with pytest.raises(ValueError, match="WRITEABLE"):
        value.setflags(write=True)
    with pytest.raises(ValueError, match="read-only"):
        value.view()[...] = 1
    with pytest.raises(ValueError, match="WRITEABLE"):
        value[:].flags.writeable = True


@pytest.mark.parametrize(
    "value",
    [
        [1, 2, 3],
        (1, 2, 3),
        machine_array("i", [1, 2, 3]),
        np.array([1, 2, 3], np.int16),
        np.array([1, 2, 3], np.uint64),
        np.array([1, 2, 3], ">i4"),
        np.array([1, 2, 3], object),
        np.array([9, 1, 9, 2, 9, 3])[1::2],
        [np.int8(1), 2, np.uint64(3)],
    ],
    ids=shown,
)
@pytest.mark.parametrize("dtype", [*INTEGERS, *FLOATS])
def test_any_integers_become_the_field_s_array_type(dtype, value):
    made = check(dtype, value)
    assert type(made) is FieldArray
    assert made.dtype == np.dtype(dtype)
    assert made.tolist() == [1, 2, 3]
    assert_nobody_can_write(made)


@pytest.mark.parametrize("dtype", FLOATS)
@pytest.mark.parametrize(
    "value",
    [
        [0.5, 1, np.float32(2)],
        np.array([0.5, 1, 2], np.float16),
        np.array([0.5, 1, 2], np.longdouble),
        [0.5, np.int8(1), np.float64(2)],
    ],
    ids=shown,
)
def test_any_numbers_become_an_array_of_floats(dtype, value):
    assert check(dtype, value).tolist() == [0.5, 1, 2]


FOREIGN = {
    "float64": [
        [True, 1.0], [np.True_], ["1.0"], [None], [1j], [[1.0], [2.0]], {1.0}, 1.0, "12", iter([1.0]), b"12345678",
        [10**400], np.array([True]), np.array(["1"]), np.array([1j]), np.array([True, 1.0], object), np.array(1.0),
        np.ma.masked_array([1.0], [True]),
    ],
    "float32": [[1e39], np.array([1e39]), [10**39]],
    "int32": [[1.0], [True], np.array([1.0]), np.array([True]), machine_array("d", [1.0])],
    "int8": [b"12"],
    "uint16": [b"12"],
    "uint8": [memoryview(machine_array("d", [1.0]))],
    "bool": [[1], [0.0], np.array([1, 0])],
}  # fmt: skip


@pytest.mark.parametrize("dtype", FOREIGN)
def test_a_number_of_another_kind_is_refused(dtype):
    for value in FOREIGN[dtype]:
        refuse(dtype, value)


@pytest.mark.parametrize(
    "value",
    [
        np.array([object()], dtype=object),
        np.array([b"1"], dtype=object),
        np.array([None]),
        np.array(["1"]),
        np.zeros(2, dtype=[("x", "i4")]),
        np.ma.masked_array([1, 2], [False, True]),
    ],
    ids=["object", "bytes", "none", "text", "record", "mask"],
)
def test_arrays_of_objects_or_masks_are_refused(value):
    for dtype in ("int32", "float64"):
        refuse(dtype, value)


@pytest.mark.parametrize("dtype", INTEGERS)
def test_an_integer_out_of_range_is_never_wrapped(dtype):
    low, high = int(np.iinfo(dtype).min), int(np.iinfo(dtype).max)
    assert check(dtype, [low, high]).tolist() == [low, high]
    for wrong in (low - 1, high + 1):
        for value in ([0, wrong], np.array([wrong])):
            refuse(dtype, value)


@pytest.mark.parametrize("dtype", FLOATS)
@pytest.mark.parametrize(
    "values", [[0, 2**53 + 1], [0.5, -(2**53) - 1], [0, np.int64(2**53 + 1)], np.array([0, 2**53 + 1])], ids=shown
)
def test_an_integer_that_no_float_is_is_refused(dtype, values):
    refuse(dtype, values)
    assert check(dtype, [2**53, 2.0**70, math.nan]).tolist()[:2] == [2**53, 2.0**70]


def test_an_error_names_the_unfitting_item(golden):
    golden(refuse("int32", [1, 2, 2.5]))
    golden(refuse("int8", [0, 128]))
    golden(refuse("float64", [0, 2**53 + 1]))


def test_bytes_are_accepted_for_uint8_alone():
    for value in (b"\x00\xff", bytearray(b"\x00\xff"), memoryview(b"\x00\xff")):
        made = check("uint8", value)
        assert made.tolist() == [0, 255]
        assert_nobody_can_write(made)
    assert check("uint8", b"").tolist() == []


def test_a_byte_array_changed_later_leaves_the_message():
    given = bytearray(b"ab")
    made = check("uint8", given)
    given[0] = 0
    assert made.tolist() == [97, 98]


@pytest.mark.parametrize("empty", [[], (), np.array([]), np.zeros((0, 3)), b""], ids=shown)
def test_an_empty_array_of_any_type_fits(empty):
    assert check("uint8", empty).dtype == np.uint8
    assert check("uint8", empty).shape == (0,)
    assert is_frozen(check("uint8", empty))


@pytest.mark.parametrize("dtype", ["uint8", "int8"])
def test_pictures_and_maps_are_flattened_by_row(dtype):
    picture = np.array([[1, 2], [3, 4]], dtype)
    assert check(dtype, picture).tolist() == [1, 2, 3, 4]
    assert check(dtype, picture.T).tolist() == [1, 3, 2, 4]


def test_other_arrays_of_more_dimensions_are_refused(golden):
    golden(refuse("float64", np.zeros((2, 2))))
    refuse("int32", np.zeros((2, 2), np.int32), at_most=4)
    refuse("bool", np.zeros((2, 2), np.bool_))


def test_lengths_are_exact_or_bounded(golden):
    assert len(check("float64", [0.0] * 9, exactly=9)) == 9
    assert len(check("float64", np.eye(3), exactly=9)) == 9
    assert len(check("float64", [0.0], at_most=2)) == 1
    golden(refuse("float64", [0.0] * 8, exactly=9))
    golden(refuse("float64", np.zeros(10), exactly=9))
    golden(refuse("float64", [0.0] * 3, at_most=2))


def test_a_writeable_array_is_copied_once():
    mine = np.zeros(3)
    made = check("float64", mine)
    mine[0] = 1
    assert made.tolist() == [0, 0, 0]
    assert mine.flags.writeable
    assert_nobody_can_write(made)


def test_a_read_only_view_of_writeable_memory_copies():
    mine = np.zeros(3)
    view = mine.view()
    view.flags.writeable = False
    made = check("float64", view)
    mine[0] = 1
    assert made.tolist() == [0, 0, 0]


def test_a_frozen_array_is_shared():
    first = check("float64", [1.0, 2.0])
    assert check("float64", first) is first
    part = first[1:]
    assert check("float64", part) is part


def test_a_reopenable_array_becomes_read_only_for_good():
    mine = np.zeros(3)
    mine.flags.writeable = False
    made = check("float64", mine)
    assert np.shares_memory(mine, made)
    assert_nobody_can_write(made)


def test_take_shares_memory_and_freezes_its_base():
    frame = np.zeros((4, 5, 3), np.uint8)
    given = take(frame.reshape(20, 3))
    assert np.shares_memory(frame, given)
    assert not frame.flags.writeable
    assert_nobody_can_write(given)
    assert np.shares_memory(check("uint8", given), frame)
    assert is_frozen(check("uint8", given))


@pytest.mark.parametrize("foreign", [bytearray(b"abcd"), memoryview(bytearray(b"abcd")), machine_array("b", b"abcd")])
def test_take_copies_memory_that_numpy_does_not_own(foreign):
    """A driver may write into its buffer whatever numpy's flags say."""
    given = take(np.frombuffer(foreign, np.uint8))
    memoryview(foreign).cast("B")[0] = 0
    assert bytes(given) == b"abcd"
    assert_nobody_can_write(given)


def test_take_of_a_subclass_gives_an_array_of_a_field():
    class Special(np.ndarray):
        pass

    given = take(np.zeros(3).view(Special))
    assert type(given) is FieldArray
    assert is_frozen(given)


def test_defaults_are_frozen():
    assert_nobody_can_write(zeros(3))
    assert_nobody_can_write(array([1.0, 2.0]))
    assert zeros().tolist() == []
    assert array([1.0, 2.5]).tolist() == [1.0, 2.5]
    assert array([0, 2**64 - 1]).tolist() == [0, 2**64 - 1]


def test_nan_equals_nan_and_zero_its_negative():
    assert same(np.array([math.nan, 0.0]), np.array([math.nan, -0.0]))
    assert not same(np.array([math.nan]), np.array([1.0]))
    assert not same(np.array([1.0]), np.array([1.0, 1.0]))


@given(npst.arrays(st.sampled_from([*INTEGERS, *FLOATS, "bool"]), npst.array_shapes(max_dims=3, max_side=3)))
def test_freezing_keeps_the_values_and_the_type(value):
    made = frozen(value)
    assert is_frozen(made)
    assert made.dtype == value.dtype
    assert np.array_equal(made, value, equal_nan=value.dtype.kind == "f")
    assert frozen(made) is made


@given(st.sampled_from(INTEGERS), st.lists(st.integers(-(2**64), 2**64), max_size=4))
def test_integers_are_accepted_exactly_within_numpy_s_range(dtype, values):
    bounds = np.iinfo(dtype)
    if all(bounds.min <= each <= bounds.max for each in values):
        assert check(dtype, values).tolist() == values
    else:
        refuse(dtype, values)


@given(st.lists(st.floats(), max_size=4))
def test_lists_and_arrays_of_floats_round_alike(values):
    narrow = [value for value in values if not math.isfinite(value) or abs(value) < 3.4028235677973366e38]
    if len(narrow) == len(values):
        assert str(check("float32", values).tolist()) == str(check("float32", np.array(values)).tolist())
    else:
        refuse("float32", values)
        refuse("float32", np.array(values))
