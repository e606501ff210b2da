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
from busflow.msgs.std_msgs import Empty, Float32, Float64


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


BOUNDED = "string<=3 text\nint8[<=2] few\nwstring<=2 wide\nfloat64[4294967295] huge"


@pytest.mark.parametrize(
    ("cls", "values"),
    [
        (Float64, {"dta": 1.0}),
        (Float64, {"data": "1"}),
        (Float64, {"data": True}),
        (Float64, {"data": 2**53 + 1}),
        (Float64, 3),
        (Float32, {"data": 1e39}),
        (Stated, {"numbers": [0, -(2**53) - 1]}),
        (Stated, {"number": 256}),
        (Stated, {"number": 1.0}),
        (Stated, {"flag": 1}),
        (Stated, {"text": 1}),
        (Stated, {"text": "\ud800"}),
        (Stated, {"numbers": [1.0]}),
        (Stated, {"numbers": [1.0, None]}),
        (Stated, {"flags": "yes"}),
        (Stated, {"number": 10**5000}),
        (JointState, {"name": ["a", 1]}),
        (PoseStamped, {"header": {"stamp": {"sec": 1 << 31}}}),
        (Empty, {"structure_needs_at_least_one_member": 1}),
        (BOUNDED, {"text": "äöüß"}),
        (BOUNDED, {"few": [1, 2, 3]}),
        (BOUNDED, {"wide": "a😀b"}),
        (BOUNDED, {"huge": [1.0]}),
    ],
    ids=lambda value: "bounded" if value is BOUNDED else None,
)
def test_value_that_does_not_fit_is_named(golden, cls, values):
    write = encoder_from_description(parse("a/msg/B", cls) if cls is BOUNDED else describe(cls))
    with golden.raises(MalformedMessage):
        write(values)


def test_defaults_are_read_as_ros_writes_them():
    lines = "string a 'it'\nstring b plain\nbool c True\nint32 d 0x10\nint8[2] e [1, 2]\nbool[] f [True, false]"
    described = parse("a/msg/B", f"{lines}\nfloat32 g 1")
    found = decoder_from_description(described)(encoder_from_description(described)({})).values()
    values = [each.tolist() if isinstance(each, memoryview) else each for each in found]
    assert values == ["it", "plain", True, 16, [1, 2], [True, False], 1.0]


@pytest.mark.parametrize("text", ["int8 a x", "bool a maybe", "float64 a 1,5", "int8[2] a 1 2"])
def test_an_invalid_default_is_refused_at_once(golden, text):
    with golden.raises(MalformedMessage):
        encoder_from_description(parse("a/msg/B", text))


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
