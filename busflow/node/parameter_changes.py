"""From a mapping of changes to the parameters they make: what is named changes, everything else keeps its value."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, TypeVar, cast

from pydantic import BaseModel

from busflow.errors import Fault, InvalidParameter, KeyPath
from busflow.node.parameters import Parameters, validate
from busflow.text import printable
from busflow.validation.faults import dotted

P = TypeVar("P", bound=Parameters)

MAX_DEPTH = 64
"""Steps that a dotted name may have; a longer one can only be a mistake, or meant to do harm."""


def with_changes(parameters: P, changes: Mapping[str, object]) -> P:
    """The parameters with some of them changed, validated as a whole.

    A name is dotted (`noise.imu`) or nested (`noise: {imu: …}`). A mapping changes of a group what it names; it
    replaces a parameter that is itself a mapping.

    >>> from pydantic import Field
    >>> class Noise(Parameters):
    ...     imu: float = Field(default=0.1, ge=0)
    ...     joints: float = 0.0
    >>> class Sensor(Parameters):
    ...     rate_hz: float = 10.0
    ...     noise: Noise = Noise()
    >>> with_changes(Sensor(), {"noise.imu": 0.5, "noise": {"joints": 1}})
    Sensor(rate_hz=10.0, noise=Noise(imu=0.5, joints=1.0))
    >>> with_changes(Sensor(), {"noise.imu": -1})
    Traceback (most recent call last):
    busflow.errors.InvalidParameter: noise.imu must be at least 0, got -1 (allowed: at least 0)

    Raises:
        InvalidParameter: With every fault; none of `changes` counts then.
    """
    assignments: dict[KeyPath, object] = {}
    for path, value in _assignments(parameters, changes, ()):
        if path in assignments:
            raise InvalidParameter([Fault(path, f"{dotted(path)} is given twice", "give it one value")])
        if len(path) > MAX_DEPTH:
            raise InvalidParameter([Fault(path[:1], f"{path[0]} is not nested that deep", None, "unknown")])
        assignments[path] = value
    data: Any = _members(parameters)
    for path, value in assignments.items():
        data = _assign(data, path, value)
    try:
        return validate(type(parameters), data)
    except InvalidParameter:
        raise
    except Exception as error:  # a node's own validator may raise anything; it is told, not swallowed
        text = f"a validator raised {type(error).__name__}: {printable(str(error), limit=200)}"
        raise InvalidParameter([Fault((), text)]) from error


def _assignments(group: BaseModel, changes: Mapping[str, object], above: KeyPath) -> Iterator[tuple[KeyPath, object]]:
    """Each value with its path from the top."""
    for key, value in changes.items():
        steps = str(key).split(".")
        inner: Any = group
        for step in steps:
            inner = getattr(inner, step, None) if isinstance(inner, BaseModel) else None
        path = (*above, *steps)
        if isinstance(value, Mapping) and isinstance(inner, BaseModel):
            yield from _assignments(inner, cast("Mapping[str, object]", value), path)
        else:
            yield path, value


def _assign(data: Any, path: KeyPath, value: object) -> Any:
    """A copy of `data` with `value` at `path`; whether it may be there is for the validation to say."""
    if not path:
        return value
    step, rest = str(path[0]), path[1:]
    if isinstance(data, list | tuple):
        items = list(cast("Sequence[Any]", data))
        if step.isdecimal() and int(step) < len(items):
            items[int(step)] = _assign(items[int(step)], rest, value)
            return items
    members: dict[str, Any] = {}
    if isinstance(data, BaseModel):
        members = _members(data)
    elif isinstance(data, Mapping):
        members = dict(cast("Mapping[str, Any]", data))
    members[step] = _assign(members.get(step), rest, value)
    return members


def _members(group: BaseModel) -> dict[str, Any]:
    """What a group holds, as it was validated."""
    return {name: getattr(group, name) for name in type(group).model_fields}
