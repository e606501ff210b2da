"""A message is read by its description alone, as plain values; what is a message is tested beside the codec."""

import numpy as np
import pytest

from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.description import Count, Field, assemble, individual
from busflow.interfaces.encoding.plain_reader import decoder_from_description
from busflow.interfaces.encoding.typesupport import TypeSupport, describe
from busflow.msgs.geometry_msgs import PoseStamped
from busflow.msgs.sensor_msgs import Image, JointState
from busflow.msgs.std_msgs import Empty, Float64MultiArray, UInt8MultiArray
from tests.new_interpreter import printed_by


def read(message):
    support = TypeSupport(type(message))
    return decoder_from_description(support.description)(support.encode(message))


def test_fields_come_in_order_as_dictionaries():
    found = read(PoseStamped())
    assert list(found) == ["header", "pose"]
    assert found["pose"] == {
        "position": {"x": 0.0, "y": 0.0, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
    }


def test_sequences_are_tuples_and_numbers_are_views():
    found = read(JointState(name=["a", "b"], position=[1.0, 2.0]))
    assert found["name"] == ("a", "b")
    assert isinstance(found["position"], memoryview)
    assert found["position"].tolist() == [1.0, 2.0]
    assert found["velocity"].tolist() == []
    assert found["position"].readonly
    assert found["velocity"].readonly


def test_an_image_is_not_copied():
    support = TypeSupport(Image)
    data = support.encode(Image(data=np.ones(1 << 20, np.uint8)))
    found = decoder_from_description(support.description)(data)
    assert np.shares_memory(np.asarray(found["data"]), np.frombuffer(data, np.uint8))


def test_numbers_of_the_other_byte_order_are_swapped():
    found = decoder_from_description(describe(Float64MultiArray))(
        bytes.fromhex("00000000 00000000 00000000 00000001 00000000 3ff0000000000000")
    )
    assert found["data"].tolist() == [1.0]
    assert found["data"].readonly


def test_memory_that_others_may_write_to_is_copied():
    data = bytearray(TypeSupport(UInt8MultiArray).encode(UInt8MultiArray(data=b"abc")))
    found = decoder_from_description(describe(UInt8MultiArray))(data)
    data[-1] = 0
    assert bytes(found["data"]) == b"abc"


def test_a_type_without_fields_is_an_empty_dictionary():
    assert read(Empty()) == {}


def deep(levels, count):
    """A description whose innermost value lies under so many arrays, each of `count` items."""
    types = [individual("a/msg/T0", [Field("x", "float64").describe()])]
    types += [
        individual(f"a/msg/T{i}", [Field("inner", f"a/msg/T{i - 1}", True, Count.FIXED, count).describe()])
        for i in range(1, levels)
    ]
    return assemble(f"a/msg/T{levels - 1}", {each["type_name"]: each for each in types})


def test_describing_a_value_of_astronomical_size_costs_nothing():
    with pytest.raises(MalformedMessage, match=r"inner\[0\].inner\[0\].* bytes are needed and 4 are left"):
        decoder_from_description(deep(15, (1 << 32) - 1))(b"\0\1\0\0" + bytes(4))


def test_a_description_is_checked_before_it_is_used():
    with pytest.raises(MalformedMessage, match="is not a mapping"):
        decoder_from_description(None)


def test_reading_and_writing_plain_values_imports_nothing_heavy():
    code = (
        "import sys, busflow.interfaces.encoding.foreign;"
        "print([m for m in ('numpy', 'pydantic', 'asyncio', 'rich') if m in sys.modules])"
    )
    assert printed_by(code) == "[]"
