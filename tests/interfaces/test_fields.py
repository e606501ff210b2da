"""What an annotation means to ROS, which values a field takes, and which declarations are refused at once."""

import json
import math
import struct
from collections.abc import Sequence
from decimal import Decimal
from enum import IntEnum
from typing import Annotated, Any, Optional, TypeVar

import numpy as np
import pytest
from annotated_types import Ge
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import BaseModel, Field, ValidationError, create_model
from typing_extensions import TypeAliasType

from busflow.errors import InvalidDeclaration, InvalidMessage
from busflow.interfaces import field_types
from busflow.interfaces.fields import PRIMITIVES, ArrayKind, Length, round_float32
from busflow.interfaces.message import (
    BoolArray,
    ByteArray,
    CharArray,
    Float32Array,
    Float64Array,
    Int8Array,
    Message,
    UInt16Array,
    array,
    fields_of,
    float32,
    float64,
    int8,
    string,
    uint8,
    wstring,
    zeros,
)

INTEGERS = {name: getattr(field_types, name) for name, kind in PRIMITIVES.items() if kind.python is int}
FLOATS = {"float32": float32, "float64": float64, "float": float}


class Color(IntEnum):
    RED = 1


class Inner(Message, package="tests"):
    x: float64 = 0.0


class Foreign:
    """Of no use to pydantic."""


def field(annotation, default=...):
    """A message class with one field of this annotation."""
    return create_model("Sample", __base__=Message, value=(annotation, default))


def hold(annotation, value):
    """What a message holds after it was given a value; the same both ways of making one."""
    cls = field(annotation)
    held = cls(value=value).value
    assert cls.model_validate({"value": value}) == cls(value=value)
    return held


def refuse(annotation, value):
    cls = field(annotation)
    with pytest.raises(InvalidMessage):
        cls(value=value)
    with pytest.raises(ValidationError) as caught:
        cls.model_validate({"value": value})
    return caught.value.errors()[0]


@pytest.mark.parametrize(
    ("annotation", "written"),
    [
        *[(each, name) for name, each in INTEGERS.items()],
        (float32, "float32"),
        (float64, "float64"),
        (string, "string"),
        (wstring, "wstring"),
        (bool, "bool"),
        (int, "int64"),
        (float, "float64"),
        (str, "string"),
        (Inner, "tests/msg/Inner"),
        (Float64Array, "float64[]"),
        (BoolArray, "bool[]"),
        (ByteArray, "byte[]"),
        (CharArray, "char[]"),
        (NDArray[np.uint16], "uint16[]"),
        (NDArray[np.uint8], "uint8[]"),
        (NDArray[np.bool_], "bool[]"),
        (Annotated[Float64Array, Length(9)], "float64[9]"),
        (Annotated[NDArray[np.float32], Length(max=4)], "float32[<=4]"),
        (Annotated[str, Length(max=10)], "string<=10"),
        (Annotated[wstring, Length(max=10)], "wstring<=10"),
        (Sequence[str], "string[]"),
        (Sequence[wstring], "wstring[]"),
        (tuple[str, ...], "string[]"),
        (Sequence[Inner], "tests/msg/Inner[]"),
        (Annotated[Sequence[Inner], Length(2)], "tests/msg/Inner[2]"),
        (Annotated[Sequence[Annotated[str, Length(max=5)]], Length(max=3)], "string<=5[<=3]"),
    ],
    ids=str,
)
def test_an_annotation_is_a_ros_type(annotation, written):
    assert [str(each) for each in fields_of(field(annotation))] == [f"{written} value"]


def test_a_field_type_describes_what_codecs_need():
    (found,) = fields_of(field(Annotated[Sequence[Annotated[str, Length(max=5)]], Length(max=3)], ["a"]))
    assert (found.name, found.base, found.array, found.size) == ("value", "string", ArrayKind.BOUNDED, 3)
    assert (found.string_bound, found.default) == (5, ("a",))
    assert fields_of(field(float64))[0].default is None


@pytest.mark.parametrize("name", INTEGERS)
def test_an_integer_field_takes_integers_in_range(name):
    annotation, kind = INTEGERS[name], PRIMITIVES[name]
    for value in (kind.low, kind.high, 1, np.int8(1), np.uint64(1), Color.RED):
        held = hold(annotation, value)
        assert held == value
        assert type(held) is int
    for value in (kind.low - 1, kind.high + 1, 2**70, np.float64(1), 1.0, True, np.True_, "1", b"1", None, Decimal(1)):
        assert refuse(annotation, value)["type"] == name


@pytest.mark.parametrize("annotation", FLOATS.values(), ids=FLOATS)
def test_a_float_field_takes_floats_and_integers(annotation):
    for value in (1.5, 1, 0, -2, np.float16(1.5), np.float32(1.5), np.float64(1.5), np.longdouble(1.5), np.int64(3)):
        held = hold(annotation, value)
        assert held == value
        assert type(held) is float
    for value in ("1.5", True, np.True_, None, b"1", 1j, Decimal("1.5"), np.array(1.5), np.array([1.5]), 10**400):
        refuse(annotation, value)


@pytest.mark.parametrize("annotation", FLOATS.values(), ids=FLOATS)
def test_nan_and_infinity_are_values(annotation):
    assert math.isnan(hold(annotation, math.nan))
    assert hold(annotation, -math.inf) == -math.inf
    assert math.isnan(hold(annotation, np.float32("nan")))


@pytest.mark.parametrize("value", [2**53 + 1, -(2**65) - 1, np.int64(2**53 + 1)])
def test_an_integer_that_no_float_is_is_refused(value):
    assert refuse(float64, value)["type"] == "float64"
    assert hold(float64, 2**60) == 2**60


def test_a_float32_is_rounded_when_given():
    assert hold(float32, 0.1) == float(np.float32(0.1)) != 0.1
    assert hold(float32, 16777217) == 16777216
    assert field(float32, 0.1)().value == float(np.float32(0.1))


@pytest.mark.parametrize("value", [1e39, -1e39, 10**39, np.float64(1e39), 3.4028235677973366e38])
def test_a_number_that_float32_cannot_hold_is_refused(value):
    assert "float32" in refuse(float32, value)["msg"]


@given(st.floats(width=32))
def test_a_float32_is_kept_as_it_is(value):
    assert struct.pack("f", round_float32(value)) == struct.pack("f", value)


def test_a_boolean_is_only_a_boolean():
    for value in (True, np.False_):
        held = hold(bool, value)
        assert held == value
        assert type(held) is bool
    for value in (0, 1, 1.0, "true", None, np.int8(1)):
        assert refuse(bool, value)["type"] == "bool"


def test_text_is_only_text_that_utf8_can_express():
    assert hold(str, "grüße") == "grüße"
    assert type(hold(str, np.str_("a"))) is str
    for value in (b"a", 1, None, ["a"], "\ud800"):
        refuse(str, value)


def test_bounded_text_is_counted_in_characters():
    assert hold(Annotated[str, Length(max=5)], "ä" * 5) == "äääää"
    refuse(Annotated[str, Length(max=5)], "a" * 6)


def test_a_sequence_is_a_tuple_at_rest():
    assert hold(Sequence[str], ["a", "b"]) == ("a", "b")
    assert hold(Sequence[Inner], [Inner(x=1), {"x": 2}]) == (Inner(x=1), Inner(x=2))
    for value in ("ab", {"a"}, {"a": 1}, iter(["a"]), [1], [None], np.array(["a"])):
        refuse(Sequence[str], value)


def test_a_sequence_has_the_length_that_is_declared():
    assert hold(Annotated[Sequence[str], Length(2)], ["a", "b"]) == ("a", "b")
    assert hold(Annotated[Sequence[str], Length(max=2)], []) == ()
    refuse(Annotated[Sequence[str], Length(2)], ["a"])
    refuse(Annotated[Sequence[str], Length(max=2)], ["a"] * 3)


def test_an_array_field_has_its_array_type():
    held = hold(Annotated[Float32Array, Length(2)], [1, 2.5])
    assert held.dtype == np.float32
    assert held.tolist() == [1, 2.5]
    assert refuse(Annotated[Float32Array, Length(2)], [1])["loc"] == ("value",)
    assert refuse(Int8Array, [200])["loc"] == ("value",)
    assert hold(ByteArray, b"\xff").tolist() == [255]
    assert hold(NDArray[np.uint16], [1]).dtype == np.uint16


def test_defaults_are_checked_and_shared():
    cls = field(Annotated[UInt16Array, Length(3)], zeros(3))
    assert cls().value is cls().value
    assert cls().value.dtype == np.uint16
    assert field(Float64Array, array([1.0, 2.0]))().value.tolist() == [1, 2]
    inner = Inner(x=1)
    assert field(Inner, inner)().value is inner
    assert field(float64, 1)().value == 1.0
    assert type(field(float64, 1)().value) is float


def test_a_default_factory_is_checked_each_time():
    made = iter([1, 2, "three"])
    cls = create_model("Sample", __base__=Message, value=(float64, Field(default_factory=lambda: next(made))))
    assert (cls().value, cls().value) == (1.0, 2.0)
    with pytest.raises(InvalidMessage):
        cls()


UNFIT = [
    (uint8, 256),
    (uint8, "1"),
    (float64, None),
    (float32, 1e39),
    (str, 1),
    (Annotated[str, Length(max=1)], "ab"),
    (Annotated[Float64Array, Length(9)], zeros(8)),
    (Annotated[Sequence[str], Length(2)], ()),
    (Sequence[str], "ab"),
    (Inner, None),
]


def test_an_unfit_default_is_refused_with_the_class():
    for annotation, default in UNFIT:
        with pytest.raises(InvalidDeclaration, match=r"Sample\.value"):
            field(annotation, default)


MEANINGLESS = [
    np.float64, np.uint8, np.ndarray, NDArray[np.complex128], NDArray[Any], NDArray[np.str_], bytes, list[str],
    list[Inner], list[float], Sequence[uint8], tuple[bool, ...], Sequence[Sequence[str]], Sequence[Float64Array],
    Annotated[float, Length(3)], Annotated[str, Length(3)], Annotated[Inner, Length(max=3)], Foreign, Message,
    Sequence[Message],
]  # fmt: skip


def test_a_meaningless_annotation_is_refused_with_advice(golden):
    for annotation in MEANINGLESS:
        with golden.raises(InvalidDeclaration, mask={r"numpy\.ndarray\[.*\]|Unable.*": "…"}):
            field(annotation)


@pytest.mark.parametrize("arguments", [(), (0,), (-1,), (1.5,), (True,), (None,)])
def test_a_length_is_a_positive_number(arguments):
    with pytest.raises(InvalidDeclaration):
        Length(*arguments)
    with pytest.raises(InvalidDeclaration):
        Length(max=arguments[0] if arguments else None)


def test_a_length_is_either_exact_or_bound():
    with pytest.raises(InvalidDeclaration):
        Length(3, max=4)


def test_a_further_constraint_of_pydantic_is_kept():
    assert refuse(Annotated[float64, Ge(0)], -1)["type"] == "greater_than_equal"
    assert hold(Annotated[float64, Ge(0)], np.float32(1)) == 1.0
    assert [str(each) for each in fields_of(field(Annotated[float64, Ge(0)]))] == ["float64 value"]


class Plan(BaseModel):
    steps: list[str] = []


@pytest.mark.parametrize(
    ("annotation", "value"),
    [
        (Optional[float64], None),  # noqa: UP045 - the old spelling must work too
        (float64 | None, 1.5),
        (int | str, "a"),
        (dict[str, int], {"a": 1}),
        (dict[str, float64], {"a": 1.5}),
        (Plan, Plan(steps=["a"])),
        (list[dict[str, str]], [{"a": "b"}]),
        (Any, [1, "a"]),
        (tuple[str, float64], ("a", 1.0)),
    ],
    ids=str,
)
def test_fields_unknown_to_ros_are_possible(annotation, value):
    cls = field(annotation)
    assert cls(value=value).value == value
    assert cls.model_validate_json(cls(value=value).model_dump_json()) == cls(value=value)
    with pytest.raises(InvalidDeclaration, match="value"):
        fields_of(cls)


def test_ros_types_keep_rules_inside_other_types():
    cls = field(dict[str, Annotated[Float64Array, Length(2)]])
    held = cls(value={"a": [1, 2]})
    assert held.value["a"].tolist() == [1, 2]
    assert cls.model_validate_json(held.model_dump_json()) == held
    assert cls.model_json_schema()["properties"]["value"]["additionalProperties"] == {
        "type": "array",
        "items": {"type": "number"},
        "minItems": 2,
        "maxItems": 2,
    }
    for wrong in ([1], ["a", "b"], [True, False]):
        with pytest.raises(InvalidMessage):
            cls(value={"a": wrong})
    with pytest.raises(InvalidMessage):
        field(uint8 | None)(value=256)


LIMITED = [
    uint8, float32, bool, Annotated[str, Length(max=3)], Annotated[Float64Array, Length(9)],
    Annotated[Sequence[str], Length(max=3)],
]  # fmt: skip


def test_json_schema_has_the_limits(golden):
    schemas = [field(each).model_json_schema()["properties"]["value"] for each in LIMITED]
    golden("\n".join(json.dumps(each, sort_keys=True) for each in schemas))


T = TypeVar("T")
Names = TypeAliasType("Names", Sequence[string])
Several = TypeAliasType("Several", Sequence[T], type_params=(T,))


def test_named_alias_means_what_it_stands_for():
    class Aliased(Message, package="test"):
        names: Names = ()
        others: Several[string] = ()

    assert [str(field) for field in fields_of(Aliased)] == ["string[] names", "string[] others"]


def test_json_schema_of_inner_messages_is_their_own():
    class Inner(Message, package="test"):
        number: int8 = 0

    class Outer(Message, package="test"):
        inner: Inner = Inner()
        several: Sequence[Inner] = ()

    properties = Outer.model_json_schema()["properties"]
    assert properties["several"]["items"] == {"$ref": "#/$defs/Inner"}
    assert Outer.model_json_schema()["$defs"]["Inner"]["properties"]["number"]["maximum"] == 127
