"""JSON form: messages that ROS cannot describe, with optional fields, unions or mappings.

Their type is described by JSON Schema; the hash that stands for it is of the schema without what is only for people. No
pydantic is imported here: the command line reads the form too.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast

from busflow.errors import InvalidDeclaration, MalformedMessage

if TYPE_CHECKING:
    from busflow.interfaces.message import Message

PREFIX = "JSON01_"
"""The prefix of a hash of this form."""

_FOR_PEOPLE = {"title", "description", "examples", "default", "deprecated", "$comment"}
_NAMED = {"properties", "$defs", "patternProperties", "dependentSchemas"}
"""The keys whose values map free names to schemas."""


def finite(data: Any) -> Any:
    """Return the data with infinity and NaN as text, as a launch file writes them: JSON has no such numbers.

    >>> finite({"range": [1.0, float("-inf")]})
    {'range': [1.0, '-.inf']}
    """
    match data:
        case float() if not math.isfinite(data):
            return ".nan" if math.isnan(data) else f"{'-' * (data < 0)}.inf"
        case Mapping():
            return {str(key): finite(each) for key, each in cast("Mapping[object, object]", data).items()}
        case list() | tuple():
            return [finite(each) for each in cast("Sequence[object]", data)]
        case _:
            return data


def schema_of(cls: type[Message]) -> dict[str, Any]:
    """Return the JSON Schema of a message class.

    Raises:
        InvalidDeclaration: A field has none.
    """
    from pydantic.errors import PydanticInvalidForJsonSchema

    try:
        return cls.model_json_schema()
    except PydanticInvalidForJsonSchema as error:
        raise InvalidDeclaration(f"{cls.__name__} cannot be described in JSON Schema: {error.message}") from None


def type_hash(schema: Mapping[str, Any]) -> str:
    """Return the hash of a schema's type, which does not depend on titles, descriptions and defaults.

    >>> type_hash({"type": "integer", "title": "X"}) == type_hash({"type": "integer"})
    True
    >>> type_hash({"properties": {"title": {"type": "integer"}}}) == type_hash({})
    False
    """
    import hashlib  # takes 4 MB, and every command imports this module for `finite`

    names: dict[str, str] = {}
    canonical = json.dumps(_canonical(schema, names), sort_keys=True, separators=(",", ":"))
    return PREFIX + hashlib.sha256(canonical.encode()).hexdigest()


def codec(cls: type[Message], name: str) -> tuple[Callable[[Message], bytes], Callable[[Any], Message]]:
    """Return an encoder and a decoder for messages of a class; both raise MalformedMessage for unfit values."""

    def encode(message: Message) -> bytes:
        try:
            return message.model_dump_json().encode()
        except ValueError as error:
            raise MalformedMessage(str(error), type_name=name) from None

    def decode(payload: bytes | bytearray | memoryview) -> Message:
        try:
            return cls.model_validate_json(bytes(payload))
        except ValueError as error:
            raise _explained(error, name) from None

    return encode, decode


def decode_json(payload: bytes | bytearray | memoryview, name: str) -> Any:
    """Return a message as a plain value.

    Raises:
        MalformedMessage: It is no JSON, lies too deep within itself, or its text is no Unicode.
    """
    from pydantic_core import from_json  # its limits are those of a message's class, which json.loads lacks

    try:
        return from_json(bytes(payload))
    except ValueError as error:
        raise MalformedMessage(f"no JSON: {error}", type_name=name) from None


def _explained(error: ValueError, name: str) -> MalformedMessage:
    """Return the first error that pydantic found."""
    faults = cast("Any", error).errors()
    return MalformedMessage(faults[0]["msg"], type_name=name, path=faults[0]["loc"])


def _canonical(schema: Any, names: dict[str, str]) -> Any:
    """Return a schema without titles and texts, its definitions named by the order of their first use.

    Pydantic names a definition after its class, and after its module too where two classes share a name; neither is
    what the schema says, and plugins' modules have other names in other processes.
    """
    if isinstance(schema, list):
        return [_canonical(each, names) for each in cast("list[Any]", schema)]
    if not isinstance(schema, Mapping):
        return schema
    found: dict[str, Any] = {}
    definitions: Mapping[str, Any] = {}
    for key, value in sorted(cast("Mapping[str, Any]", schema).items()):
        if key == "$defs":
            definitions = value
        elif key == "$ref":
            found[key] = names.setdefault(value.rpartition("/")[2], f"{len(names)}")
        elif key in _NAMED:
            found[key] = {name: _canonical(value[name], names) for name in sorted(value)}
        elif key in ("const", "enum"):
            found[key] = value
        elif key not in _FOR_PEOPLE:
            found[key] = _canonical(value, names)
    if definitions:
        found["$defs"] = _definitions(definitions, names)
    return found


def _definitions(definitions: Mapping[str, Any], names: dict[str, str]) -> dict[str, Any]:
    """Return the definitions that a schema refers to, directly or through others."""
    found: dict[str, Any] = {}
    while missing := [name for name in names if names[name] not in found]:
        for name in missing:
            found[names[name]] = _canonical(definitions.get(name, True), names)
    return found
