"""CDR is what ROS 2 writes; other input is read or refused, and no image is copied.

Tests of `cdr.py`, `cdr_decoder.py`, `cdr_encoder.py` and `cdr_layout.py`.
"""

import contextlib
import itertools
import json
import math
import struct
import tracemalloc
import types
from collections.abc import Sequence
from typing import Annotated

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import Field, field_validator
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from busflow.definitions.recorded import parse
from busflow.errors import IncompatibleType, InvalidDeclaration, MalformedMessage
from busflow.interfaces.action import ActionType
from busflow.interfaces.arrays import is_frozen
from busflow.interfaces.encoding.cdr import Codec
from busflow.interfaces.encoding.description import DEPTH
from busflow.interfaces.encoding.msg_text import ros2msg
from busflow.interfaces.encoding.plain_reader import decoder_from_description
from busflow.interfaces.encoding.plain_writer import encoder_from_description
from busflow.interfaces.encoding.typesupport import TypeSupport, describe
from busflow.interfaces.fields import PRIMITIVES
from busflow.interfaces.message import (
    ArrayKind,
    BoolArray,
    Float32Array,
    Int64Array,
    Length,
    Message,
    ServiceType,
    UInt16Array,
    fields_of,
    find_type,
    float32,
    int8,
    int64,
    string,
    take,
    type_name,
    uint16,
    wstring,
)
from busflow.msgs.geometry_msgs import Point, Point32, Polygon, Vector3
from busflow.msgs.sensor_msgs import Image, Imu
from busflow.msgs.std_msgs import Bool, Empty, Float64MultiArray, Header, Int32, String, UInt8MultiArray
from tests.interfaces.any_message import MESSAGES, TYPES, by_group, messages
from tests.vectors import each_case

ROS = get_typestore(Stores.LATEST)
ROSBAGS = get_typestore(Stores.EMPTY)
"""Types as busflow describes them, in the codec of rosbags, which compiles one that several contain once."""
PARTS = [part for each in TYPES if issubclass(each, ServiceType) for part in (each.Request, each.Response)]
PARTS += [part for each in TYPES if issubclass(each, ActionType) for part in (each.Goal, each.Result, each.Feedback)]
ALL = MESSAGES | {type_name(cls): cls for cls in PARTS}


class Flags(Message, package="test"):
    flag: bool = False
    flags: BoolArray = ()
    names: tuple[str, ...] = ()


def codec(cls):
    return Codec(cls, describe(cls))


def plain(value):
    """A message as JSON would show it."""
    if isinstance(value, Message):
        return {field.name: plain(getattr(value, field.name)) for field in fields_of(type(value))}
    if isinstance(value, np.ndarray | memoryview):
        return plain(value.tolist())
    if isinstance(value, dict):
        return {key: plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [plain(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return value


def fields_in(case):
    """The fields of a case's value; rosbags lists a type's constants among them."""
    return plain({key: each for key, each in case["value"].items() if not key.isupper()})


# What ROS 2 writes


@each_case("g_cdr_vectors")
def test_a_message_is_encoded_as_by_two_others(case):
    coded = codec(find_type(case["type"]))
    little, big = bytes.fromhex(case["cdr_le"]), bytes.fromhex(case["cdr_be"])
    assert plain(coded.decode(little)) == plain(coded.decode(big)) == fields_in(case)
    assert coded.encode(coded.decode(little)) == little
    assert coded.encode(coded.decode(big)) == little
    assert TypeSupport(coded._cls).type_hash == case["rihs01"]


@each_case("g_cdr_recorded")
def test_what_real_nodes_wrote_is_read(case):
    coded = codec(find_type(case["type"]))
    message = coded.decode(bytes.fromhex(case["cdr"]))
    assert plain(message) == fields_in(case)
    assert coded.decode(coded.encode(message)) == message
    assert case["topic_type_hash"] in (None, TypeSupport(type(message)).type_hash)


STATED = {
    "string-length-0": {"data": ""},
    "string-embedded-NUL": {"data": "a\0b"},
    "image-size-mismatch": [0, 1, 2, 3, 4],
    "time-nanosec-over-1e9": {"sec": 1, "nanosec": 0xFFFFFFFF},
}
"""What is read where the cases leave it to us; the other ones are refused."""


@each_case("g_cdr_malformed")
def test_hostile_bytes_are_read_or_refused_without_memory(case):
    coded, data = codec(find_type(case["type"])), bytes.fromhex(case["cdr"])
    read = decoder_from_description(describe(find_type(case["type"])))
    if case["id"] in STATED:
        assert case["expect"] == "defined"
        expected = STATED[case["id"]]
        found = plain(coded.decode(data))
        assert expected in (found, found.get("data"))
        assert plain(read(data)) == found
        return
    for decode in (coded.decode, read):
        tracemalloc.start()
        with pytest.raises(MalformedMessage) as caught:
            decode(data)
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        assert caught.value.type_name == case["type"]
        assert peak < 50_000, "an error, its traceback and no more"


@pytest.mark.parametrize(
    ("cls", "data"),
    [
        (String, "0001000064000000 61626300"),
        (String, "0001000002000000 6161"),
        (String, "0001000003000000 61ff00"),
        (String, "0001000004000000 eda08000"),
        (Bool, "0001000002"),
        (Flags, "00010000 01000000 02000000 01020000 00000000"),
        (Flags, "00010000 00000000 00000000 01000000 02000000 6161"),
        (Flags, "00010000 00000000 00000000 01000000 02000000 ff00"),
        (Int32, "0001000007000000 00000000"),
        (Int32, "000300000700000000000000"),
        (Int32, ""),
        (Header, "00010000 00000000 00000000 0a"),
        (Polygon, "00010000 02000000 0000000000000000 00000000 0000000000000000 000000"),
        (
            find_type("diagnostic_msgs/DiagnosticStatus"),
            "00010000 00000000" + "0100000000000000" * 3 + "02000000" + "0100000000000000" * 3 + "0200000061610000",
        ),
    ],
)
def test_an_error_names_type_field_and_byte(golden, cls, data):
    with golden.raises(MalformedMessage) as caught:
        codec(cls).decode(bytes.fromhex(data))
    assert caught.value.type_name == type_name(cls)


@pytest.mark.parametrize("spare", [0, 1, 2, 3])
def test_padding_to_a_multiple_of_4_is_ignored(spare):
    assert codec(Int32).decode(bytes.fromhex("0001000007000000") + b"\xff" * spare) == Int32(data=7)


def test_the_options_of_a_header_are_ignored():
    assert codec(Int32).decode(bytes.fromhex("0001fff307000000")) == Int32(data=7)


# Any message


def big_endian(message):
    """The message in the other byte order, by the most naive encoder there can be."""
    data = bytearray(b"\0\0\0\0")

    def put(size, value):
        data.extend(bytes((4 - len(data)) % size) + value)

    def write(value, field):
        if not isinstance(field.base, str):
            write_all(value)
        elif field.base == "wstring":
            units = value.encode("utf-16-be")
            put(4, struct.pack(">I", len(units) // 2))
            data.extend(b"".join(b"\0\0" + units[i : i + 2] for i in range(0, len(units), 2)))
        elif field.base == "string":
            put(4, struct.pack(">I", len(value.encode()) + 1))
            data.extend(value.encode() + b"\0")
        else:
            dtype = np.dtype(PRIMITIVES[field.base].dtype)
            put(dtype.itemsize, np.array(value, dtype).astype(dtype.newbyteorder(">")).tobytes())

    def write_all(inner):
        for field in fields_of(type(inner)):
            value = getattr(inner, field.name)
            if field.array in (ArrayKind.BOUNDED, ArrayKind.UNBOUNDED):
                put(4, struct.pack(">I", len(value)))
            for each in [value] if field.array is ArrayKind.NONE else value:
                write(each, field)
        if not fields_of(type(inner)):
            data.append(0)

    write_all(message)
    return bytes(data)


def arrays(message):
    """All arrays of a message that lie directly in it."""
    return [value for value in message.__dict__.values() if isinstance(value, np.ndarray)]


each_group = pytest.mark.parametrize("group", by_group(ALL))


@each_group
def test_any_message_survives_and_is_encoded_as_rosbags(group):
    for cls in group:
        check_survival(cls)


def check_survival(cls, examples=3):
    coded, name = codec(cls), type_name(cls)
    read, write = decoder_from_description(describe(cls)), encoder_from_description(describe(cls))
    # rosbags takes a byte for signed and knows no services: it is given the type in our words, a byte as a uint8.
    words = ros2msg(describe(cls)).replace("byte ", "uint8 ").replace("byte[", "uint8[")
    words, msg_name = (text.replace("/srv/", "/msg/").replace("/action/", "/msg/") for text in (words, name))
    known = "wstring" not in words  # rosbags has no such type
    if known:
        ROSBAGS.register(get_types_from_msg(words, msg_name))

    @settings(max_examples=examples)
    @given(messages(cls))
    def holds(message):
        data = coded.encode(message)
        decoded = coded.decode(data)
        assert decoded == message
        assert coded.decode(big_endian(message)) == message
        assert (
            json.dumps(plain(read(data))) == json.dumps(plain(message)) == json.dumps(plain(read(big_endian(message))))
        )
        assert write(read(data)) == data
        assert not known or bytes(ROSBAGS.serialize_cdr(ROSBAGS.deserialize_cdr(data, msg_name), msg_name)) == data
        assert decoded.model_dump_json() == message.model_dump_json()
        assert decoded.model_fields_set == set(cls.model_fields)
        assert decoded.model_extra is None
        assert all(each.dtype is other.dtype for each, other in zip(arrays(decoded), arrays(message), strict=True))
        assert decoded.replace() == message

    holds()


@each_group
def test_mutated_messages_are_read_or_refused_never_crash(group):
    for cls in group:
        check_refusal(cls)


def check_refusal(cls, examples=3):
    """A codec and the description agree about what is a message, whatever happens to the bytes."""
    coded, read = codec(cls), decoder_from_description(describe(cls))

    @settings(max_examples=examples)
    @given(messages(cls), st.data())
    def holds(message, data):
        payload = bytearray(data.draw(st.sampled_from([coded.encode(message), big_endian(message)])))
        for _ in range(data.draw(st.integers(1, 4))):
            where = data.draw(st.integers(0, len(payload)))
            new = data.draw(
                st.binary(max_size=8) | st.sampled_from([b"\xff\xff\xff\xff", b"\0\0\0\x80", b"\x10\0\0\0"])
            )
            payload[where : where + data.draw(st.sampled_from([0, len(new), 8]))] = new
        found = []
        for decode in (coded.decode, read):
            try:
                found.append(json.dumps(plain(decode(bytes(payload)))))
            except MalformedMessage:
                found.append(None)
        assert found[0] == found[1]

    holds()


# Memory


def peak_of(decode, data):
    tracemalloc.start()
    with contextlib.suppress(MalformedMessage):
        decode(data)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


@pytest.mark.parametrize(
    "name", ["std_msgs/Float64MultiArray", "sensor_msgs/Image", "sensor_msgs/JointState", "std_msgs/String"]
)
def test_no_length_takes_more_than_tenfold_memory(name):
    cls = find_type(name)
    decoders = codec(cls).decode, decoder_from_description(describe(cls))
    lengths = st.sampled_from([1, 2000, 19_000, 1 << 20, (1 << 32) - 1])

    @given(st.lists(st.tuples(st.integers(1, 12), lengths), min_size=1, max_size=6))
    def holds(changes):
        payload = bytearray(b"\0\1\0\0" + bytes(20_000))
        for word, length in changes:
            payload[4 * word : 4 * word + 4] = struct.pack("<I", length)
        for decode in decoders:
            assert peak_of(decode, bytes(payload)) < 10 * len(payload) + 50_000

    holds()


class Wide(Message, package="test"):
    items: Sequence[Point] = ()
    texts: Sequence[string] = ()
    flags: BoolArray = ()


@pytest.mark.parametrize("count", [100_000, 1 << 30, (1 << 32) - 1])
@pytest.mark.parametrize("before", [0, 1, 2])
def test_announced_items_that_are_missing_take_no_memory(before, count):
    data = b"\0\1\0\0" + bytes(4 * before) + struct.pack("<I", count) + bytes(50_000)
    assert peak_of(codec(Wide).decode, data) < 100_000 + 60_000


def test_a_large_image_is_not_copied_nor_writeable():
    image = Image(data=np.arange(1 << 20, dtype=np.uint8))
    data = codec(Image).encode(image)
    decoded = codec(Image).decode(data)
    assert np.shares_memory(decoded.data, np.frombuffer(data, np.uint8))
    assert is_frozen(decoded.data)
    decode = codec(Image).decode
    assert peak_of(decode, data) < 10_000
    assert decoded == image


def test_numbers_of_8_bytes_are_copied_aligned():
    data = codec(Float64MultiArray).encode(Float64MultiArray(data=np.arange(1000.0)))
    decoded = codec(Float64MultiArray).decode(data)
    assert decoded.data.flags.aligned
    assert is_frozen(decoded.data)


def test_a_large_array_is_copied_once_when_encoded():
    image, encode = Image(data=take(np.zeros(1 << 20, np.uint8))), codec(Image).encode
    assert peak_of(encode, image) < 1.1 * (1 << 20)


def test_memory_that_others_may_write_to_is_copied():
    data = bytearray(codec(UInt8MultiArray).encode(UInt8MultiArray(data=b"abc")))
    for payload in (data, memoryview(data), memoryview(bytes(data))):
        decoded = codec(UInt8MultiArray).decode(payload)
        assert is_frozen(decoded.data)
        assert decoded.data.tobytes() == b"abc"


# What the standard messages do not have


class Everything(Message, package="test"):
    """Each kind of field where it is the least convenient."""

    a: int8 = 1
    flags: Annotated[BoolArray, Length(3)] = (True, False, True)
    b: uint16 = 2
    wide: wstring = ""
    c: int8 = 3
    many: Annotated[Int64Array, Length(200)] = np.arange(200)
    d: int8 = 4
    words: Annotated[Sequence[string], Length(2)] = ("", "")
    e: int8 = 5
    short: Annotated[string, Length(max=4)] = ""
    points: Annotated[Sequence[Point32], Length(2)] = (Point32(), Point32())
    nothing: Empty = Empty()
    nothings: Sequence[Empty] = ()
    wides: Sequence[wstring] = ()
    shorts: Annotated[Sequence[Annotated[string, Length(max=4)]], Length(max=2)] = ()
    bounded: Annotated[Float32Array, Length(max=3)] = ()
    g: int8 = 7
    several: Annotated[UInt16Array, Length(600)] = np.zeros(600, np.uint16)
    f: int64 = 6
    inner: Sequence[Wide] = ()


def test_each_kind_of_field_survives_anywhere():
    check_survival(Everything, examples=25)
    check_refusal(Everything, examples=25)


class Bounded(Message, package="test"):
    few: Annotated[Float32Array, Length(max=2)] = ()
    points: Annotated[Sequence[Point32], Length(max=1)] = ()
    words: Annotated[Sequence[string], Length(max=1)] = ()
    short: Annotated[string, Length(max=2)] = ""
    wide: Annotated[wstring, Length(max=2)] = ""


UNBOUNDED = "float32[] few\ngeometry_msgs/Point32[] points\nstring[] words\nstring short\nwstring wide"


BOUNDS = {"few": [1.0] * 3, "points": [{}] * 2, "words": ["", ""], "short": "abc", "wide": "abc"}


@pytest.mark.parametrize("field", BOUNDS)
def test_value_that_exceeds_a_bound_is_refused(golden, field):
    points = "=" * 80 + "\nMSG: geometry_msgs/Point32\nfloat32 x\nfloat32 y\nfloat32 z"
    write = encoder_from_description(parse("test/msg/Bounded", f"{UNBOUNDED}\n{points}"))
    with golden.raises(MalformedMessage):
        codec(Bounded).decode(write({field: BOUNDS[field]}))
    within = {name: value[:-1] for name, value in BOUNDS.items()}
    assert codec(Bounded).decode(write(within)).wide == "ab"


class Said(Message, package="test"):
    wide: wstring = ""
    short: Annotated[wstring, Length(max=2)] = ""


def test_wide_text_has_utf16_units_in_32_bits():
    """As rosidl_typesupport_fastrtps writes it: the number of units, no NUL, a pair of surrogates for an emoji."""
    data = codec(Said).encode(Said(wide="é😀"))
    assert data.hex(" ", 4) == "00010000 03000000 e9000000 3dd80000 00de0000 00000000"
    assert codec(Said).decode(data) == Said(wide="é😀")


@pytest.mark.parametrize("units", [[0xD83D], [0x10000], [0x61, 0xDE00]])
def test_invalid_wide_text_is_refused(golden, units):
    data = b"\0\1\0\0" + struct.pack(f"<I{len(units)}II", len(units), *units, 0)
    with golden.raises(MalformedMessage):
        codec(Said).decode(data)


@pytest.mark.parametrize(
    "message",
    [Said(short="a😀"), Everything(short="äöü😀"), Everything(shorts=["a", "äöü"])],
    ids=["wide", "text", "sequence"],
)
def test_bound_of_a_text_counts_its_characters(message):
    """As rclpy counts them, and as the message is checked; ROS 2 checks no bound where it writes and reads bytes."""
    cls = type(message)
    data = codec(cls).encode(message)
    assert codec(cls).decode(data) == message
    values = decoder_from_description(describe(cls))(data)
    assert encoder_from_description(describe(cls))(values) == data


class Sure(Message, package="test"):
    here: bool
    side: string


def test_field_that_has_to_be_given_states_no_default():
    assert [each["default_value"] for each in describe(Sure)["type_description"]["fields"]] == ["", ""]


def test_value_that_no_constructor_has_checked_is_named(golden):
    with golden.raises(MalformedMessage):
        codec(Said).encode(Said.model_construct(wide=1, short=""))


def test_a_message_of_another_type_is_not_written(golden):
    with golden.raises(IncompatibleType):
        codec(Imu).encode(Vector3())


class Ruled(Message, package="test"):
    share: Annotated[float32, Field(ge=0, le=1)] = 0.0


class Even(Message, package="test"):
    number: int64 = 0

    @field_validator("number")
    @classmethod
    def check(cls, value):
        if value % 2:
            raise ValueError("an even number is needed")
        return value


class Holder(Message, package="test"):
    even: Even = Even()
    ruled: Sequence[Ruled] = ()


def test_decoding_applies_the_rules_of_a_class(golden):
    good = Holder(even=Even(number=4), ruled=[Ruled(share=0.5)])
    data = codec(Holder).encode(good)
    assert codec(Holder).decode(data) == good
    with golden.raises(MalformedMessage):
        codec(Holder).decode(data.replace(struct.pack("<q", 4), struct.pack("<q", 5)))
    with golden.raises(MalformedMessage):
        codec(Holder).decode(data.replace(struct.pack("<f", 0.5), struct.pack("<f", 1.5)))


class Derived(Point, package="test"):
    """A point that says more than a point: what is sent as a point is a point."""

    label: str = ""


def test_a_subclass_instance_travels_as_the_fields_class():
    data = codec(Wide).encode(Wide(items=[Derived(x=1.0, label="far")]))
    assert codec(Wide).decode(data) == Wide(items=[Point(x=1.0)])


def nested(depth, *, in_sequences):
    """A message with others within each other."""
    message = Int32(data=7)
    for number in range(depth):
        cls = type(message)
        kind, default, value = (Sequence[cls], (), [message]) if in_sequences else (cls, cls(), message)
        body = {"__module__": __name__, "__annotations__": {"inner": kind}, "inner": default}
        outer = types.new_class(
            f"Level{number}", (Message,), {"package": "test"}, lambda names, body=body: names.update(body)
        )
        message = outer(inner=value)
    return message


@pytest.mark.parametrize(("depth", "in_sequences"), [(DEPTH - 1, False), (19, True)])
def test_messages_nest_up_to_a_limit(depth, in_sequences):
    message = nested(depth, in_sequences=in_sequences)
    cls = type(message)
    assert codec(cls).decode(codec(cls).encode(message)) == message


def test_deeper_sequences_are_refused_in_words(golden):
    message = nested(20, in_sequences=True)
    with golden.raises(InvalidDeclaration):
        codec(type(message)).decode(b"")
    with pytest.raises(InvalidDeclaration):
        codec(type(message)).encode(message)


def test_strided_arrays_are_written_in_order():
    frame = take(np.arange(10_000, dtype=np.uint8))
    data = codec(UInt8MultiArray).encode(UInt8MultiArray(data=frame[::2]))
    assert codec(UInt8MultiArray).decode(data).data.tolist() == frame[::2].tolist()


class Labels(Message, package="test"):
    """Texts at any alignment: those of a fixed number begin wherever the text before them has ended."""

    before: str = ""
    pair: Annotated[Sequence[str], Length(2)] = ("", "")
    names: Sequence[str] = ()


NAMES = [(), ("a",), ("a", "b"), ("a", "b", "c"), ("b", "a"), ("ab",), ("a", ""), ("", "a"), ("æ",)]


def test_texts_of_two_messages_stay_apart():
    messages = [
        Labels(before="x" * length, pair=(*names, "", "")[:2], names=names) for names in NAMES for length in range(4)
    ]
    data = [TypeSupport(Labels).encode(message) for message in messages]
    used = TypeSupport(Labels)
    for first, second in itertools.product(range(len(messages)), repeat=2):
        for each in (first, second):
            assert used.encode(messages[each]) == data[each]
            assert used.decode(data[each]) == messages[each]
    # Some write an empty text as a length of 0: only zeros, and where they end the alignment alone tells.
    for length in (1, 0, 3, 2, 0, 1):
        text = struct.pack("<I", length + 1) + b"x" * length + b"\0"
        zeros = bytes(-len(text) % 4 + 12)
        assert used.decode(b"\0\1\0\0" + text + zeros) == Labels(before="x" * length)


class Crashing(Message, package="test"):
    number: int64 = 0

    @field_validator("number")
    @classmethod
    def check(cls, value):
        return 1 // (value - 7) if value else 0


def test_rule_that_crashes_makes_bytes_malformed():
    data = codec(Crashing).encode(Crashing())[:4] + struct.pack("<q", 7)
    with pytest.raises(MalformedMessage, match="ZeroDivisionError"):
        codec(Crashing).decode(data)


def test_value_changed_behind_the_check_is_refused():
    message = Vector3()
    message.__dict__["x"] = "far"
    with pytest.raises(MalformedMessage):
        codec(Vector3).encode(message)
