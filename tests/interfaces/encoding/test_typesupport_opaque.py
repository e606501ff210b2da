"""Messages of types without a class."""

from busflow.definitions.recorded import parse
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.foreign import ForeignType
from busflow.interfaces.encoding.typesupport import TypeSupport, opaque


def test_opaque_types_are_described_and_keep_their_bytes():
    description = parse("my_pkg/msg/Thing", "int32 a\nstring b\n")
    foreign = ForeignType("my_pkg/msg/Thing", rihs01(description), description)
    support = TypeSupport(opaque(foreign))
    assert (support.name, support.encoding, support.definition_encoding) == ("my_pkg/msg/Thing", "cdr", "ros2msg")
    assert (support.type_hash, support.definition) == (foreign.type_hash, foreign.definition)
    payload = foreign.encode({"a": 3, "b": "x"}) + b"\xee"
    message = support.decode(memoryview(payload))
    assert support.encode(message) == payload
    assert message == support.decode(payload)


def test_what_ros_cannot_describe_stays_json():
    schema = {"type": "object", "properties": {"a": {"type": "integer"}}}
    from busflow.interfaces.encoding.json_form import type_hash

    support = TypeSupport(opaque(ForeignType("my_pkg/msg/Odd", type_hash(schema), schema)))
    assert (support.encoding, support.definition_encoding) == ("json", "jsonschema")
    assert support.encode(support.decode(b'{"a": 1}')) == b'{"a": 1}'
