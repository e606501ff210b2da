"""JSON Schema of a launch file, with the parameters of each known plugin, so that editors can complete and check it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic.errors import PydanticInvalidForJsonSchema
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaWarningKind

from busflow.bus.qos import PRESETS, QoS
from busflow.launchfile.model.keys import LaunchKeys
from busflow.launchfile.model.supervision import Restart

Schema = dict[str, Any]

_EXPRESSION: Schema = {"type": "string", "pattern": r"\$\{"}
_NODE_NAME = r"^/?([A-Za-z_][A-Za-z0-9_]*/)*[A-Za-z_][A-Za-z0-9_]*$|\$\{"
_RESTARTED = ("NodeKeys", "DefaultKeys", "ProcessKeys", "ProgramKeys")
"""Sections that have a `restart`."""
_BESIDE = ("description", "default", "readOnly")
"""Schema keys that describe a value independently of its type."""


class PluginSchema(NamedTuple):
    """Plugin data that the schema needs."""

    name: str
    parameters: type[BaseModel]
    summary: str = ""


class _Generator(GenerateJsonSchema):
    """pydantic's generator without its warnings about defaults that JSON cannot hold; these are left out."""

    ignored_warning_kinds: set[JsonSchemaWarningKind] = {"skipped-choice", "non-serializable-default"}  # noqa: RUF012  # as pydantic has it


def launch_schema(plugins: Iterable[PluginSchema] = ()) -> Schema:
    """Return the schema, in draft 2020-12.

    >>> launch_schema()["properties"]["seed"]["description"]
    'Decides every random number of the run.'
    """
    root = _model_schema(LaunchKeys, "")
    definitions: Schema = {"Expression": _EXPRESSION, **root.pop("$defs")}
    profile = _model_schema(QoS, "QoS.")
    definitions |= {**profile.pop("$defs", {}), "QoS": profile}
    _place_qos(root, definitions)
    _place_restart(definitions)
    for file in (root, definitions["ProfileKeys"]):
        file["properties"]["record"]["anyOf"].insert(0, {"type": "string"})  # short for `to`
    definitions["RecordKeys"]["anyOf"] = [{"required": ["to"]}, {"required": ["snapshot"]}]
    definitions["NodeKeys"] |= _by_plugin(plugins, definitions)
    for graph in (root, definitions["GroupKeys"], definitions["ProfileKeys"]):
        _place_includes(graph)
        for section in ("nodes", "programs"):
            graph["properties"][section]["propertyNames"] = {"pattern": _NODE_NAME}
    for name, section in [("", root), *definitions.items()]:
        if name == "" or name.endswith("Keys"):
            section["patternProperties"] = {"^x-": True}
            section["properties"] = {key: _or_null(each) for key, each in section["properties"].items()}
    return {
        "$schema": GenerateJsonSchema.schema_dialect,
        "title": "busflow launch file",
        **root,
        "$defs": dict(sorted(definitions.items())),
    }


def _model_schema(model: type[Any], prefix: str) -> Schema:
    """Return a model's schema. Every value may be an expression; the names of its definitions get the prefix."""
    template = f"#/$defs/{prefix}{{model}}"
    try:
        schema: Schema = model.model_json_schema(ref_template=template, schema_generator=_Generator)
    except PydanticInvalidForJsonSchema:
        return {"type": "object"}  # a type of the plugin's own that JSON cannot describe
    definitions = schema.pop("$defs", {})
    opened = {f"{prefix}{name}": _opened(each) for name, each in definitions.items()}
    return {**_opened(schema), "$defs": opened} if opened else _opened(schema)


def _opened(schema: Schema) -> Schema:
    """Return a schema that also allows `${…}` for every value inside, without titles (they only repeat names)."""
    found: Schema = {}
    for key, value in schema.items():
        if key == "title" or (key == "default" and not _in_json(value)):
            continue
        if key == "description":
            found[key] = str(value).partition("\n\n")[0]
        elif key == "properties":
            found[key] = {name: _expressible(_opened(each)) for name, each in value.items()}
        elif key in {"items", "additionalProperties"} and isinstance(value, Mapping):
            found[key] = _expressible(_opened(dict(value)))  # pyright: ignore[reportUnknownArgumentType]  # JSON
        elif key in {"anyOf", "oneOf", "prefixItems"}:
            found[key] = [_opened(each) for each in value]
        else:
            found[key] = value
    return found


def _expressible(schema: Schema) -> Schema:
    """Allow an expression in a schema that does not allow any text already."""
    form, beside, options = _forms(schema)
    if not form or form.get("type") == "object" or any(map(_is_any_text, options)):
        return schema
    if any(option.get("$ref", "").endswith("Keys") for option in options):
        return schema
    return {**beside, "anyOf": [*options, {"$ref": "#/$defs/Expression"}]}


def _forms(schema: Schema) -> tuple[Schema, Schema, list[Schema]]:
    """Split a schema into the type of the value, its description, and the alternatives of its type."""
    form = {key: value for key, value in schema.items() if key not in _BESIDE}
    beside = {key: value for key, value in schema.items() if key in _BESIDE}
    return form, beside, form["anyOf"] if set(form) == {"anyOf"} else [form]


def _is_any_text(schema: Schema) -> bool:
    return schema.get("type") == "string" and not {"enum", "pattern"} & schema.keys()


def _in_json(value: object) -> bool:
    """Return whether JSON can hold a default; it has no infinity."""
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError):
        return False
    return True


def _or_null(schema: Schema) -> Schema:
    """Allow null in a schema: an empty key of a launch file counts as not stated."""
    stated = {key: value for key, value in schema.items() if key != "default" or value is not None}
    form, beside, options = _forms(stated)
    if not form or {"type": "null"} in options:
        return {**beside, **form}
    return {**beside, "anyOf": [*options, {"type": "null"}]}


def _place_qos(root: Schema, definitions: Schema) -> None:
    """Allow a QoS profile, by name or by fields, wherever the launch file takes one."""
    fields = {"$ref": "#/$defs/QoS"}
    profile: Schema = {"anyOf": [{"enum": list(PRESETS)}, {"type": "string"}, fields]}
    for graph in (root, definitions["ProfileKeys"]):
        graph["properties"]["qos"]["additionalProperties"] = fields
    definitions["TopicKeys"]["properties"]["qos"] |= profile
    for section, key in product(("NodeKeys", "DefaultKeys"), ("publishers", "subscriptions")):
        definitions[section]["properties"][key]["additionalProperties"] = profile


def _place_includes(graph: Schema) -> None:
    """Allow a file's name in `include` as short for an entry with only `file`."""
    name, entry = {"type": "string"}, {"$ref": "#/$defs/IncludeKeys"}
    description = graph["properties"]["include"]["description"]
    items = {"type": "array", "items": {"anyOf": [name, entry]}}
    graph["properties"]["include"] = {"description": description, "anyOf": [name, items]}


def _place_restart(definitions: Schema) -> None:
    """Allow one word in `restart` as short for an entry with only `policy`."""
    whole: Schema = {"$ref": "#/$defs/RestartKeys"}
    forms: list[Schema] = [{"enum": list(Restart)}, whole, {"$ref": "#/$defs/Expression"}]
    for properties in (definitions[owner]["properties"] for owner in _RESTARTED):
        description = properties["restart"]["description"]
        properties["restart"] = {"description": description, "default": "never", "anyOf": forms}


def _by_plugin(plugins: Iterable[PluginSchema], definitions: Schema) -> Schema:
    """Return the part of a node's schema that depends on its `plugin`: its parameters."""
    names: list[Schema] = []
    branches: list[Schema] = []
    for plugin in plugins:
        key = f"{plugin.name}.parameters"
        parameters = _model_schema(plugin.parameters, f"{plugin.name}.")
        definitions |= parameters.pop("$defs", {})
        required = parameters.pop("required", None)
        definitions[key] = parameters
        names.append({"const": plugin.name, **({"description": plugin.summary} if plugin.summary else {})})
        then: Schema = {"properties": {"parameters": {"anyOf": [{"$ref": f"#/$defs/{key}"}, {"type": "null"}]}}}
        if required:
            # What a plugin requires may also stand in a file of parameters.
            stated = {"required": ["parameters"], "properties": {"parameters": {"required": required}}}
            then["anyOf"] = [{"required": ["parameters_from"]}, stated]
        chosen = {"properties": {"plugin": {"const": plugin.name}}, "required": ["plugin"]}
        branches.append({"if": chosen, "then": then})
    properties: Schema = definitions["NodeKeys"]["properties"]
    properties["plugin"]["anyOf"] = [*names, {"type": "string", "minLength": 1}]
    return {"properties": properties, **({"allOf": branches} if branches else {})}
