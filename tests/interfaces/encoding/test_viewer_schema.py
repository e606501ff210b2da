"""JSON Schemas are flattened into what viewers read, and the whole ones stay in recordings."""

import enum
import json
from typing import Any, Literal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.encoding.viewer_schema import SOURCE, recorded_definition, source_schema, viewer_schema
from busflow.interfaces.message import Message
from busflow.msgs.geometry_msgs import Point


class Colour(enum.Enum):
    RED = "red"
    BLUE = "blue"


class Tree(Message, package="test"):
    label: str = ""
    children: tuple["Tree", ...] = ()


class Loose(Message, package="test"):
    """Every kind of field that no definition file of ROS 2 can state."""

    at: Point | None = None
    path: tuple[Point | None, ...] = ()
    pair: tuple[int, int] = (0, 0)
    mixed: tuple[int, str] = (0, "")
    choice: int | str = 0
    colour: Colour = Colour.RED
    word: Literal["a", "b"] = "a"
    scores: dict[str, float] = {}  # noqa: RUF012  # a message copies its defaults
    rows: tuple[tuple[int, int], ...] = ()
    tree: Tree = Tree()


def test_a_property_of_several_types_is_left_out(golden):
    found = viewer_schema(TypeSupport(Loose).description)
    golden("\n".join(f"{name}: {json.dumps(schema)}" for name, schema in found.pop("properties").items()))
    assert found == {"type": "object"}


def test_an_enumeration_has_its_values_type():
    schema = {"type": "object", "properties": {"a": {"enum": [1, 2]}, "b": {"enum": [1, "x"]}, "c": {"enum": []}}}
    assert viewer_schema(schema)["properties"] == {"a": {"type": "integer"}}


def test_bytes_keep_their_encoding():
    schema = {"type": "object", "properties": {"a": {"type": "string", "contentEncoding": "base64"}}}
    assert viewer_schema(schema) == schema


def test_references_that_double_stay_small():
    definitions: dict[str, Any] = {
        f"T{n}": {"type": "object", "properties": {key: {"$ref": f"#/$defs/T{n + 1}"} for key in "ab"}}
        for n in range(64)
    }
    assert len(json.dumps(viewer_schema({"$ref": "#/$defs/T0", "$defs": definitions}))) < 1_000_000


def test_a_recorded_definition_holds_the_whole_schema():
    schema = TypeSupport(Loose).description
    definition = json.loads(recorded_definition(schema))
    assert definition.pop(SOURCE) == schema
    assert definition == viewer_schema(schema)
    assert source_schema(json.loads(TypeSupport(Loose).definition)) == schema
    assert source_schema(schema) == schema


@pytest.mark.parametrize("schema", [{}, {"anyOf": 3}, {"type": ["object"]}, {"type": "object", "properties": 3}])
def test_a_schema_of_no_kind_is_an_object(schema: dict[str, Any]):
    assert viewer_schema(schema) == {"type": "object"}


KEYS = ["type", "anyOf", "oneOf", "prefixItems", "items", "properties", "enum", "x"]
WORDS = st.sampled_from(["object", "array", "string", "null", "other"])


@given(
    st.recursive(
        WORDS | st.integers() | st.none(), lambda inner: st.lists(inner) | st.dictionaries(st.sampled_from(KEYS), inner)
    )
)
def test_no_schema_raises(schema: Any):
    assert viewer_schema({"type": "object", "properties": {"x": schema}})["type"] == "object"
