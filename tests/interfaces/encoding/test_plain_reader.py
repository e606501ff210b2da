"""A message is read by its description alone, as plain values; what is a message is tested beside the codec."""

import numpy as np

from busflow.errors import MalformedMessage
from busflow.interfaces.encoding.description import Count, Field, assemble, individual
from busflow.interfaces.encoding.plain_reader import decoder_from_description
from busflow.interfaces.encoding.typesupport import TypeSupport, describe
from busflow.msgs.sensor_msgs import Image, JointState
from busflow.msgs.std_msgs import UInt8MultiArray
from tests.new_interpreter import printed_by


def test_sequences_are_tuples_and_numbers_are_views():
    support = TypeSupport(JointState)
    data = support.encode(JointState(name=["a", "b"], position=[1.0, 2.0]))
    found = decoder_from_description(support.description)(data)
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


def test_memory_that_others_may_write_to_is_copied():
    data = bytearray(TypeSupport(UInt8MultiArray).encode(UInt8MultiArray(data=b"abc")))
    found = decoder_from_description(describe(UInt8MultiArray))(data)
    data[-1] = 0
    assert bytes(found["data"]) == b"abc"


def deep(levels, count):
    """A description whose innermost value lies under so many arrays, each of `count` items."""
    types = [individual("a/msg/T0", [Field("x", "float64").describe()])]
    types += [
        individual(f"a/msg/T{i}", [Field("inner", f"a/msg/T{i - 1}", True, Count.FIXED, count).describe()])
        for i in range(1, levels)
    ]
    return assemble(f"a/msg/T{levels - 1}", {each["type_name"]: each for each in types})


def test_describing_a_value_of_astronomical_size_costs_nothing(golden):
    with golden.raises(MalformedMessage):
        decoder_from_description(deep(15, (1 << 32) - 1))(b"\0\1\0\0" + bytes(4))


def test_a_description_is_checked_before_it_is_used(golden):
    with golden.raises(MalformedMessage):
        decoder_from_description(None)


def test_reading_and_writing_plain_values_imports_nothing_heavy():
    code = (
        "import sys, busflow.interfaces.encoding.foreign;"
        "print([m for m in ('numpy', 'pydantic', 'asyncio', 'rich') if m in sys.modules])"
    )
    assert printed_by(code) == "[]"
