"""What is typed becomes the bytes that the class would have written, or an error that names the field."""

import json
from typing import Annotated

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.definitions.recorded import parse
from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.plain_reader import decoder_from_description
from busflow.interfaces.encoding.plain_writer import encoder_from_description
from busflow.interfaces.encoding.typesupport import TypeSupport, describe
from busflow.interfaces.message import BoolArray, Float64Array, Length, Message, float32, string, uint8, wstring
from busflow.msgs.geometry_msgs import PoseStamped
from busflow.msgs.sensor_msgs import CameraInfo, Imu, JointState
from busflow.msgs.std_msgs import Empty, Float32, Float64, Int8MultiArray, String


class Stated(Message, package="test"):
    """Fields with defaults of each kind."""

    number: uint8 = 7
    share: float32 = 0.5
    flag: bool = True
    text: string = 'a "quoted" text'
    wide: wstring = "é😀"
    numbers: Annotated[Float64Array, Length(2)] = (1.0, 2.0)
    flags: BoolArray = (True, False)


@pytest.mark.parametrize("cls", [Stated, PoseStamped, Imu, JointState, CameraInfo, Empty])
def test_what_is_not_given_has_its_default(cls):
    assert encoder_from_description(describe(cls))({}) == TypeSupport(cls).encode(cls())


@pytest.mark.parametrize(
    ("message", "values"),
    [
        (Float64(data=0.5), {"data": 0.5}),
        (Float64(data=1), {"data": 1}),
        (String(data="ahoy"), {"data": "ahoy"}),
        (JointState(name=["a", "bcd", ""], position=[1, 2.5]), {"name": ["a", "bcd", ""], "position": [1, 2.5]}),
        (PoseStamped().replace(header={"frame_id": "map"}), {"header": {"frame_id": "map"}}),
        (Int8MultiArray(data=[1, -1]), {"data": [1, -1]}),
        (Stated(wide="x😀", flags=[]), {"wide": "x😀", "flags": []}),
    ],
    ids=lambda value: type(value).__name__,
)
def test_values_become_what_the_class_writes(message, values):
    assert encoder_from_description(describe(type(message)))(values) == TypeSupport(type(message)).encode(message)


@pytest.mark.parametrize(
    ("cls", "values", "said"),
    [
        (Float64, {"dta": 1.0}, "std_msgs/msg/Float64: std_msgs/msg/Float64 has no field 'dta'; did you mean 'data'?"),
        (Float64, {"data": "1"}, "std_msgs/msg/Float64: data: '1' is not a valid float64"),
        (Float64, {"data": True}, "std_msgs/msg/Float64: data: True is not a valid float64"),
        (
            Float64,
            {"data": 2**53 + 1},
            "data: no float64 is 9007199254740993; write the nearest, 9007199254740992.0",
        ),
        (Stated, {"numbers": [0, -(2**53) - 1]}, "test/msg/Stated: numbers[1]: no float64 is -9007199254740993"),
        (Float32, {"data": 1e39}, "std_msgs/msg/Float32: data: 1e+39 is out of the range of float32"),
        (Float64, 3, "std_msgs/msg/Float64: std_msgs/msg/Float64 takes its fields by name, not 3"),
        (Stated, {"number": 256}, "test/msg/Stated: number: 256 is out of the range of uint8"),
        (Stated, {"number": 1.0}, "test/msg/Stated: number: 1.0 is not a valid uint8"),
        (Stated, {"flag": 1}, "test/msg/Stated: flag: 1 is not a valid bool"),
        (Stated, {"text": 1}, "test/msg/Stated: text: 1 is not a text"),
        (Stated, {"text": "\ud800"}, "test/msg/Stated: text: '\\ud800' is not valid Unicode: surrogates not allowed"),
        (Stated, {"numbers": [1.0]}, "test/msg/Stated: numbers: exactly 2 items are needed, not 1"),
        (Stated, {"numbers": [1.0, None]}, "test/msg/Stated: numbers[1]: None is not a valid float64"),
        (Stated, {"flags": "yes"}, "test/msg/Stated: flags: a list is needed, not 'yes'"),
        (Stated, {"number": 10**5000}, "test/msg/Stated: number: so large a number is out of the range of uint8"),
        (JointState, {"name": ["a", 1]}, "sensor_msgs/msg/JointState: name[1]: 1 is not a text"),
        (
            PoseStamped,
            {"header": {"stamp": {"sec": 1 << 31}}},
            "geometry_msgs/msg/PoseStamped: header.stamp.sec: 2147483648 is out of the range of int32",
        ),
        (Empty, {"structure_needs_at_least_one_member": 1}, "has no field 'structure_needs_at_least_one_member'"),
    ],
)
def test_what_does_not_fit_is_named(cls, values, said):
    with pytest.raises(MalformedMessage) as caught:
        encoder_from_description(describe(cls))(values)
    assert said in str(caught.value)


def test_bounds_are_kept():
    encode = encoder_from_description(parse("a/msg/B", "string<=3 text\nint8[<=2] few\nwstring<=2 wide"))
    encode({"text": "abc", "few": [1, 2], "wide": "😀"})
    for values, reason in [
        ({"text": "äö"}, "4 bytes of UTF-8 where ROS allows 3"),
        ({"few": [1, 2, 3]}, "at most 2"),
        ({"wide": "a😀"}, "3 units of UTF-16 where ROS allows 2"),
    ]:
        with pytest.raises(MalformedMessage, match=reason):
            encode(values)


def test_defaults_are_read_as_ros_writes_them():
    lines = (
        "string a 'it'",
        "string b plain",
        "bool c True",
        "int32 d 0x10",
        "int8[2] e [1, 2]",
        "bool[] f [True, false]",
    )
    described = parse("a/msg/B", "\n".join([*lines, "float32 g 1"]))
    found = decoder_from_description(described)(encoder_from_description(described)({}))
    assert [each.tolist() if isinstance(each, memoryview) else each for each in found.values()] == [
        "it",
        "plain",
        True,
        16,
        [1, 2],
        [True, False],
        1.0,
    ]


@pytest.mark.parametrize("text", ["int8 a x", "bool a maybe", "float64 a 1,5", "int8[2] a 1 2"])
def test_an_invalid_default_is_refused_at_once(text):
    with pytest.raises(MalformedMessage, match=r"a: .* is not a default of"):
        encoder_from_description(parse("a/msg/B", text))


def test_an_astronomical_fixed_array_is_refused_without_memory():
    encode = encoder_from_description(parse("a/msg/B", "float64[4294967295] a"))
    with pytest.raises(MalformedMessage, match="exactly 4294967295 items"):
        encode({"a": [1.0]})


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["data", "name", "x"]), inner, max_size=3)
    ),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from(["header", "name", "position", "velocity"]), json_values, max_size=3))
def test_whatever_is_typed_is_written_or_refused(values):
    encode, decode = (make(describe(JointState)) for make in (encoder_from_description, decoder_from_description))
    try:
        found = decode(encode(values))
    except MalformedMessage:
        return
    for key in ("name", "position", "velocity"):
        written = found[key].tolist() if isinstance(found[key], memoryview) else list(found[key])
        assert json.dumps(written) == json.dumps(
            [float(each) if key != "name" else each for each in values.get(key, ())]
        )
