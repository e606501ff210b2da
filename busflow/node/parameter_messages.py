"""Parameters as the messages of ROS 2's `rcl_interfaces`: values, descriptors, and the event of a change."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, cast

from busflow.msgs.rcl_interfaces import (
    FloatingPointRange,
    IntegerRange,
    Parameter,
    ParameterDescriptor,
    ParameterEvent,
    ParameterType,
    ParameterValue,
)
from busflow.validation.annotations import UNBOUNDED, Bounds

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from busflow.clock import Time
    from busflow.node.parameter_store import ParameterChange
    from busflow.node.parameters import ParameterInfo

INT64 = range(-(1 << 63), 1 << 63)

_FIELDS = {
    ParameterType.PARAMETER_BOOL: "bool_value",
    ParameterType.PARAMETER_INTEGER: "integer_value",
    ParameterType.PARAMETER_DOUBLE: "double_value",
    ParameterType.PARAMETER_STRING: "string_value",
    ParameterType.PARAMETER_BYTE_ARRAY: "byte_array_value",
    ParameterType.PARAMETER_BOOL_ARRAY: "bool_array_value",
    ParameterType.PARAMETER_INTEGER_ARRAY: "integer_array_value",
    ParameterType.PARAMETER_DOUBLE_ARRAY: "double_array_value",
    ParameterType.PARAMETER_STRING_ARRAY: "string_array_value",
}
_TYPES = {
    "bool": ParameterType.PARAMETER_BOOL,
    "int": ParameterType.PARAMETER_INTEGER,
    "float": ParameterType.PARAMETER_DOUBLE,
    "str": ParameterType.PARAMETER_STRING,
    "path": ParameterType.PARAMETER_STRING,
    "list[bool]": ParameterType.PARAMETER_BOOL_ARRAY,
    "list[int]": ParameterType.PARAMETER_INTEGER_ARRAY,
    "list[float]": ParameterType.PARAMETER_DOUBLE_ARRAY,
    "list[str]": ParameterType.PARAMETER_STRING_ARRAY,
}


def type_of(value: object, info: ParameterInfo | None = None) -> int:
    """Return the constant of `ParameterType` for a plain value; `info` decides the type of an empty list.

    What ROS 2 has no type for, a mapping or a list of unlike things, is a string that holds JSON.
    """
    match value:
        case None:
            return ParameterType.PARAMETER_NOT_SET
        case bool():
            return ParameterType.PARAMETER_BOOL
        case int() if value in INT64:
            return ParameterType.PARAMETER_INTEGER
        case float():
            return ParameterType.PARAMETER_DOUBLE
        case []:
            return _TYPES.get(info.type if info else "", ParameterType.PARAMETER_STRING_ARRAY)
        case list():
            return _type_of_items({type(each) for each in cast("list[Any]", value)}, cast("list[Any]", value))
        case _:
            return ParameterType.PARAMETER_STRING


def _type_of_items(types: set[type], items: list[Any]) -> int:
    if types == {bool}:
        return ParameterType.PARAMETER_BOOL_ARRAY
    if types == {int} and all(each in INT64 for each in items):
        return ParameterType.PARAMETER_INTEGER_ARRAY
    if types in ({float}, {int, float}):
        return ParameterType.PARAMETER_DOUBLE_ARRAY
    return ParameterType.PARAMETER_STRING_ARRAY if types == {str} else ParameterType.PARAMETER_STRING


def value_message(value: object, info: ParameterInfo | None = None) -> ParameterValue:
    """Return a plain value as ROS 2 sends it.

    >>> value_message([1.0, 2.5]).double_array_value.tolist()
    [1.0, 2.5]
    """
    kind = type_of(value, info)
    if kind == ParameterType.PARAMETER_NOT_SET:
        return ParameterValue()
    if kind == ParameterType.PARAMETER_STRING and not isinstance(value, str):
        value = json.dumps(value)
    fields: dict[str, Any] = {"type": kind, _FIELDS[kind]: value}
    return ParameterValue(**fields)


def plain_value(message: ParameterValue) -> object:
    """Return the plain value of a ROS 2 parameter value; None for an unknown type, as for one that is not set."""
    field = _FIELDS.get(message.type)
    if field is None:
        return None
    value: Any = getattr(message, field)
    if hasattr(value, "tolist"):
        return value.tolist()
    return list(cast("tuple[str, ...]", value)) if isinstance(value, tuple) else value


def descriptor_message(info: ParameterInfo, value: object = None) -> ParameterDescriptor:
    """Return the descriptor of a parameter as ROS 2 sends it; a range without an end has the type's own limit there."""
    kind = _TYPES.get(info.type.removesuffix(" or null")) or type_of(info.default if value is None else value, info)
    bounded = info.bounds != UNBOUNDED
    integers, floats = kind == ParameterType.PARAMETER_INTEGER, kind == ParameterType.PARAMETER_DOUBLE
    constraints = [str(info.bounds)] if bounded else []
    if info.choices:
        constraints.append(f"one of {', '.join(map(str, info.choices))}")
    return ParameterDescriptor(
        name=info.name,
        type=kind,
        description=info.description,
        additional_constraints="; ".join(constraints),
        read_only=info.read_only,
        floating_point_range=(_floating_point_range(info.bounds),) if bounded and floats else (),
        integer_range=(_integer_range(info.bounds),) if bounded and integers else (),
    )


def _floating_point_range(bounds: Bounds) -> FloatingPointRange:
    low = float("-inf") if bounds.minimum is None else bounds.minimum
    high = float("inf") if bounds.maximum is None else bounds.maximum
    return FloatingPointRange(from_value=float(low), to_value=float(high), step=bounds.step or 0.0)


def _integer_range(bounds: Bounds) -> IntegerRange:
    step = int(bounds.step or 0)
    low = INT64.start if bounds.minimum is None or math.isinf(bounds.minimum) else bounds.minimum
    high = INT64.stop - 1 if bounds.maximum is None or math.isinf(bounds.maximum) else bounds.maximum
    whole = bounds._replace(minimum=low, maximum=high, step=step or 1).by_steps()
    return IntegerRange(from_value=int(whole.minimum or 0), to_value=int(whole.maximum or 0), step=step)


def event_message(
    stamp: Time, node: str, changes: Iterable[ParameterChange], infos: Mapping[str, ParameterInfo]
) -> ParameterEvent:
    """Return the event of a node's changed parameters: without an old value one is new, without a new one deleted."""
    added: list[Parameter] = []
    changed: list[Parameter] = []
    deleted: list[Parameter] = []
    for change in changes:
        kind = deleted if change.new is None else added if change.old is None else changed
        kind.append(Parameter(name=change.name, value=value_message(change.new, infos.get(change.name))))
    return ParameterEvent(
        stamp=stamp.to_msg(),
        node=node,
        new_parameters=added,
        changed_parameters=changed,
        deleted_parameters=deleted,
    )
