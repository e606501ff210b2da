"""Messages that ROS cannot describe travel as JSON, under a hash of what their schema demands."""

import hashlib
import json
import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest
from pydantic import Field

from busflow.errors import InvalidDeclaration, MalformedMessage
from busflow.interfaces.encoding import json_form
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Float64Array, Message, ServiceType, float64
from busflow.msgs.geometry_msgs import Point


class Detection(Message, package="test"):
    """Fields that no definition file of ROS 2 can state."""

    where: Point | None = None
    scores: dict[str, float64] = Field(default_factory=dict)
    label: int | str = "unknown"
    weights: Float64Array = ()
    others: tuple[Point | None, ...] = ()


FULL = Detection(
    where=Point(x=1.0), scores={"cat": 0.5, "title": 1.0}, label=3, weights=[1.0, np.nan], others=(None, Point(y=2.0))
)


def test_a_message_survives():
    support = TypeSupport(Detection)
    assert support.encoding == "json"
    decoded = support.decode(support.encode(FULL))
    assert decoded == FULL
    assert not decoded.weights.flags.writeable
    assert support.decode(memoryview(support.encode(Detection()))) == Detection()


def test_a_peer_without_the_class_reads_it():
    found = json_form.decode_json(TypeSupport(Detection).encode(FULL), "test/msg/Detection")
    assert found["where"] == {"x": 1.0, "y": 0.0, "z": 0.0}
    assert list(found) == ["where", "scores", "label", "weights", "others"]


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\xff",
        b'{"where": {"x": "1"}}',
        b'{"scores": {"cat": "high"}}',
        b'{"wher": null}',
        b'{"where": {"x": 9007199254740993}}',
        b'{"scores": {"cat": 9007199254740993}}',
        b'{"weights": [9007199254740993]}',
    ],
)
def test_hostile_bytes_are_refused_with_the_field(golden, data):
    with golden.raises(MalformedMessage, mask={"Invalid JSON.*|Input .*|Extra .*": "…"}) as caught:
        TypeSupport(Detection).decode(data)
    assert caught.value.type_name == "test/msg/Detection"


@pytest.mark.parametrize(
    "data", [b"", b"\xff", b"[" * 100_000, b"[" * 600 + b"]" * 600, b"1" * 10_000, b"{'a': 1}", b'"\\ud800"']
)
def test_hostile_bytes_are_refused_without_the_class_too(data):
    for decode in (json_form.decode_json, lambda data, _name: TypeSupport(Detection).decode(data)):
        with pytest.raises(MalformedMessage):
            decode(data, "test/msg/Detection")


def test_the_hash_covers_allowed_values_and_nothing_else():
    class Detection2(Message, package="test"):
        """Another text."""

        where: Point | None = Point()
        scores: dict[str, float64] = Field(default_factory=lambda: {"a": 1.0})
        label: int | str = 0
        weights: Float64Array = (1.0,)
        others: tuple[Point | None, ...] = ()

    class Detection3(Detection2, package="test"):
        label: int | str | None = 0

    same, other = TypeSupport(Detection2), TypeSupport(Detection3)
    assert TypeSupport(Detection).type_hash == same.type_hash
    assert TypeSupport(Detection).type_hash != other.type_hash
    assert len(same.type_hash) == len("JSON01_") + 64


def test_the_hash_ignores_the_names_of_definitions():
    """Two plugins' classes of one name get longer names in the schema, with the name of their module in them."""
    schema = json_form.schema_of(Detection)
    renamed = json.loads(json.dumps(schema).replace("Point", "plugin_7__Point"))
    assert renamed != schema
    assert json_form.type_hash(renamed) == json_form.type_hash(schema)


def test_a_field_may_have_a_schema_keywords_name():
    class Book(Message, package="test"):
        title: str | None = None
        description: str | None = None

    class Paper(Message, package="test"):
        title: str | None = None

    assert TypeSupport(Book).type_hash != TypeSupport(Paper).type_hash


def test_a_recursive_type_has_a_hash_and_travels():
    class Tree(Message, package="test"):
        label: str = ""
        left: "Tree | None" = None

    support = TypeSupport(Tree)
    tree = Tree(label="a", left=Tree(label="b"))
    assert support.decode(support.encode(tree)) == tree
    assert support.type_hash.startswith("JSON01_")


class Find(ServiceType, package="test"):
    """A service whose answer may be missing."""

    class Request(Message):
        label: str = ""

    class Response(Message):
        where: Point | None = None


def test_a_json_services_hash_covers_request_and_response(golden):
    class Seek(ServiceType, package="test"):
        class Request(Message):
            label: str = ""
            again: bool = False

        class Response(Message):
            where: Point | None = None

    assert TypeSupport(Find).type_hash.startswith("JSON01_")
    assert TypeSupport(Find).type_hash != TypeSupport(Seek).type_hash
    with golden.raises(InvalidDeclaration):
        TypeSupport(Find).encode(Find.Request())


def test_the_hash_stays_the_same():
    """It names the type on the wire: a change of how it is computed breaks those who run another version."""
    schema = {
        "$defs": {
            "Point": {"properties": {"x": {"default": 0.0, "type": "number"}}, "title": "Point", "type": "object"}
        },
        "properties": {"where": {"anyOf": [{"$ref": "#/$defs/Point"}, {"type": "null"}], "default": None}},
        "title": "Response",
        "type": "object",
    }
    counted = (
        '{"$defs":{"0":{"properties":{"x":{"type":"number"}},"type":"object"}},'
        '"properties":{"where":{"anyOf":[{"$ref":"0"},{"type":"null"}]}},"type":"object"}'
    )
    assert json_form.type_hash(schema) == "JSON01_" + hashlib.sha256(counted.encode()).hexdigest()


def test_numbers_that_json_has_not_are_text():
    data = {"range": [1.0, float("-inf"), (math.inf, math.nan)], 1: "a"}
    assert json_form.finite(data) == {"range": [1.0, "-.inf", [".inf", ".nan"]], "1": "a"}


def test_value_without_a_form_in_json_is_refused():
    class Loose(Message, package="test"):
        thing: Any = None

    support = TypeSupport(Loose)
    assert support.decode(support.encode(Loose(thing=1))) == Loose(thing=1)
    with pytest.raises(MalformedMessage):
        support.encode(Loose(thing=object()))


def test_the_hash_is_also_of_the_values_allowed():
    def moded(*values):
        class Moded(Message, package="test"):
            mode: Literal[values] | None = None
            at: dict[str, int] = Field(default_factory=dict)

        return TypeSupport(Moded).type_hash

    assert moded("a", "b") == moded("a", "b")
    assert len({moded("a", "b"), moded("a", "c"), moded("a")}) == 3


def test_field_without_a_json_schema_is_refused(golden):
    class Calling(Message, package="test"):
        function: Callable[[], int] | None = None

    with golden.raises(InvalidDeclaration, mask={": .*core_schema": ": core_schema"}):
        json_form.schema_of(Calling)
