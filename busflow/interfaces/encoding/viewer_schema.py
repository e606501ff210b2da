"""Viewer schema: a JSON Schema in the few words that viewers read, where each property has one type.

Foxglove and Lichtblick read `type`, `properties` and `items`, and open no topic whose schema has a `$ref`, an `anyOf`
or a `prefixItems` anywhere. A property that has no single type is left out: viewers show its values nevertheless.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any, cast

SOURCE = "x-busflow-schema"
"""Key of the whole schema in a recorded definition; JSON Schema lets readers ignore what they do not know."""
_MOST_FIELDS = 10_000
"""Most fields of a viewer schema: a few definitions that refer to each other twice could make it endless."""
_MOST_DEPTH = 32
_TYPES: Mapping[type, str] = {str: "string", float: "number", int: "integer", bool: "boolean"}
_LEAVES = set(_TYPES.values())


def viewer_schema(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return the schema in the form that viewers read.

    >>> optional = {"anyOf": [{"$ref": "#/$defs/P"}, {"type": "null"}]}
    >>> inner = {"type": "object", "properties": {"x": {"type": "number"}}}
    >>> viewer_schema({"type": "object", "properties": {"at": optional, "any": {}}, "$defs": {"P": inner}})
    {'type': 'object', 'properties': {'at': {'type': 'object', 'properties': {'x': {'type': 'number'}}}}}
    """
    return _Flattening(schema.get("$defs", {})).flat(schema) or {"type": "object"}


def recorded_definition(schema: Mapping[str, Any]) -> str:
    """Return the text of a recorded definition: the schema for viewers, which contains the whole one."""
    return json.dumps(viewer_schema(schema) | {SOURCE: schema})


def source_schema(definition: Mapping[str, Any]) -> Any:
    """Return the whole schema of a recorded definition; the definition itself if busflow did not record it."""
    return definition.get(SOURCE, definition)


class _Flattening:
    """The flattening of one schema: definitions take the place of references."""

    def __init__(self, definitions: Mapping[str, Any]) -> None:
        self._definitions = definitions
        self._within: list[str] = []
        self._fields_left = _MOST_FIELDS

    def flat(self, schema: Any, depth: int = 0) -> dict[str, Any] | None:
        """Return the schema without references and choices; None where that leaves no single type."""
        if not isinstance(schema, Mapping) or depth > _MOST_DEPTH:  # true and false are schemas, too
            return None
        found = cast("Mapping[str, Any]", schema)
        if "$ref" in found:
            return self._referred(found["$ref"].rpartition("/")[2], depth)
        if choices := _items(found, "anyOf") or _items(found, "oneOf"):
            return self._same([each for each in choices if each != {"type": "null"}], depth)
        match found.get("type", _type_of(_items(found, "enum"))):
            case "object":
                return self._object(found.get("properties"), depth)
            case "array":
                items = self._same(_items(found, "prefixItems") or [found.get("items")], depth)
                # Viewers know no array of arrays.
                return {"type": "array", "items": items} if items and items["type"] != "array" else None
            case str() as leaf if leaf in _LEAVES:
                encoding = {"contentEncoding": found["contentEncoding"]} if "contentEncoding" in found else {}
                return {"type": leaf, **encoding}
            case _:
                return None

    def _object(self, properties: object, depth: int) -> dict[str, Any]:
        flat: dict[str, Any] = {}
        for name, schema in cast("Mapping[str, Any]", properties if isinstance(properties, Mapping) else {}).items():
            self._fields_left -= 1
            if self._fields_left >= 0 and (inner := self.flat(schema, depth + 1)) is not None:
                flat[name] = inner
        return {"type": "object", "properties": flat} if flat else {"type": "object"}

    def _referred(self, name: str, depth: int) -> dict[str, Any] | None:
        if name in self._within:  # a type that holds itself
            return {"type": "object"}
        self._within.append(name)
        found = self.flat(self._definitions.get(name), depth + 1)
        self._within.pop()
        return found

    def _same(self, schemas: Iterable[Any], depth: int) -> dict[str, Any] | None:
        """Return the form that all these schemas share."""
        forms = [self.flat(each, depth + 1) for each in schemas]
        return forms[0] if forms and all(each == forms[0] for each in forms) else None


def _items(schema: Mapping[str, Any], key: str) -> list[Any]:
    """Return the list under a key; an empty one if another program put another value there."""
    found = schema.get(key)
    return cast("list[Any]", found) if isinstance(found, list) else []


def _type_of(values: list[object]) -> str | None:
    """Return the type of an enumeration's values, which need not state it."""
    kinds = {_TYPES.get(type(each)) for each in values}
    return kinds.pop() if len(kinds) == 1 else None
