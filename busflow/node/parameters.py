"""`Parameters`: the parameters of a node, declared as a pydantic model, strict about types and ranges."""

from __future__ import annotations

import inspect
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, cast

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from busflow.errors import Fault, InvalidDeclaration, InvalidParameter, KeyPath
from busflow.text import did_you_mean, printable
from busflow.validation.annotations import UNBOUNDED, Bounds, StrictModel, choices, refuse_bare, split, type_word
from busflow.validation.faults import dotted, faults, plain
from busflow.validation.tracebacks import line

T = TypeVar("T")
P = TypeVar("P", bound="Parameters")

MAX_DEPTH = 64
"""Steps that a dotted name may have; a longer one can only be a mistake, or meant to do harm."""


class Parameters(StrictModel):
    """The parameters of a node, each with a type, a default, a range and a description.

    >>> from pydantic import Field
    >>> class SensorParameters(Parameters):
    ...     rate_hz: float = Field(default=10.0, gt=0, description="How often to publish.")
    >>> validate(SensorParameters, {"rate_hz": 50}).rate_hz
    50.0
    >>> validate(SensorParameters, {"rate_hz": "50"})
    Traceback (most recent call last):
    busflow.errors.InvalidParameter: rate_hz must be a number, got text '50' (remove the quotes)
    """

    def __init_subclass__(cls, **kwargs: Any) -> None:
        """Refuse values without an annotation."""
        super().__init_subclass__(**kwargs)
        refuse_bare(cls)

    if not TYPE_CHECKING:  # pragma: no branch  # to type checkers an assignment stays the error of a frozen class

        def __setattr__(self, name: str, value: object) -> None:
            """Refuse to change one value: parameters are replaced as a whole, once they are checked."""
            if name.startswith("_"):
                return super().__setattr__(name, value)
            fix = (
                f'write graph.set_parameters("node", {{"{name}": …}}), or self.{name} = … for a value of the node alone'
            )
            raise InvalidParameter([Fault((name,), f"{name} cannot be assigned: parameters are frozen", fix)])


class _ReadOnlyMark:
    """The mark that `ReadOnly` leaves on a field."""

    def __get_pydantic_json_schema__(self, schema: Any, handler: Any) -> dict[str, Any]:
        return {**handler(schema), "readOnly": True}


ReadOnly: TypeAlias = Annotated[T, _ReadOnlyMark()]
"""A parameter that cannot change while the node runs: `frame_id: ReadOnly[str] = "imu_link"`."""


@dataclass(frozen=True, slots=True)
class ParameterInfo:
    """One parameter as `busflow plugins info` shows it; a nested one has a dotted name."""

    name: str
    type: str
    default: object = None
    required: bool = False
    bounds: Bounds = UNBOUNDED
    choices: tuple[object, ...] | None = None
    description: str = ""
    read_only: bool = False


def validate(cls: type[P], data: Mapping[str, object]) -> P:
    """Return the parameters that `data` states, defaults filled in.

    Raises:
        InvalidParameter: With every fault of `data`, not the first alone.
        InvalidDeclaration: Defaults of the class are not what their own annotations allow. Its cause has the faults of
            `data`, if there are any.
    """
    try:
        return cls.model_validate(data, by_name=True)
    except ValidationError as error:
        found = faults(error, cls, data, noun="parameter")
    unstated = cls.model_fields.keys() - data.keys()
    defaults = [each for each in found if each.code != "missing" and each.path and each.path[0] in unstated]
    if not defaults:
        raise InvalidParameter(found)
    wrong = InvalidDeclaration(f"{cls.__name__}: {'; '.join(f'the default of {each.message}' for each in defaults)}")
    with suppress(OSError, TypeError):  # a class that was typed into an interpreter has no source
        wrong.place = line(inspect.getfile(cls), inspect.getsourcelines(cls)[1])
    stated = [each for each in found if each not in defaults]
    raise wrong from (InvalidParameter(stated) if stated else None)


def describe(cls: type[Parameters]) -> tuple[ParameterInfo, ...]:
    """Return each parameter of `cls` in the order of declaration, nested ones flattened to dotted names."""
    cls.model_rebuild()  # a no-op unless the class names a type that was defined after it
    return tuple(_rows(cls, "", {}, read_only=False))


def value_of(parameters: BaseModel, name: str) -> Any:
    """Return the plain value of a dotted name; None inside an optional group that is not there."""
    found: Any = parameters
    for step in name.split("."):
        found = getattr(found, step, None)
    return plain(found)


def grouped(values: Mapping[str, object]) -> dict[str, Any]:
    """Return values by dotted name with a mapping for each group.

    >>> grouped({"rate_hz": 10.0, "noise.imu": 0.5})
    {'rate_hz': 10.0, 'noise': {'imu': 0.5}}
    """
    found: Any = {}
    for name, value in values.items():
        found = _assign(found, tuple(name.split(".")), value)
    return found


def unknown(name: str, known: Iterable[str]) -> InvalidParameter:
    """Return the error that a name is no parameter, with the nearest one that is."""
    fix = did_you_mean(name, known, none="leave it out: the node has no parameters")
    return InvalidParameter([Fault(tuple(name.split(".")), f"unknown parameter {name}", fix, "unknown")])


def _rows(
    cls: type[BaseModel], prefix: str, defaults: Mapping[str, Any], *, read_only: bool
) -> Iterator[ParameterInfo]:
    for name, info in cls.model_fields.items():
        annotation, inner = split(info.annotation)
        metadata = (*inner, *info.metadata)
        default = defaults[name] if name in defaults else _default(info)
        fixed = read_only or any(isinstance(each, _ReadOnlyMark) for each in metadata)
        if isinstance(annotation, type) and issubclass(annotation, BaseModel):
            yield from _rows(annotation, f"{prefix}{name}.", default or {}, read_only=fixed)
        else:
            yield ParameterInfo(
                name=prefix + name,
                type=type_word(info.annotation),
                default=default,
                required=info.is_required() and name not in defaults,
                bounds=Bounds.of(metadata),
                choices=choices(cast("object", annotation)),
                description=info.description or "",
                read_only=fixed,
            )


def _default(info: FieldInfo) -> Any:
    """Return the default as plain data; None where there is none or it depends on the other fields."""
    if info.is_required() or info.default_factory_takes_validated_data:
        return None
    return plain(info.get_default(call_default_factory=True))


def with_changes(parameters: P, changes: Mapping[str, object]) -> P:
    """Return the parameters with some of them changed, validated as a whole.

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
    except Exception as error:  # a node's own validator may raise anything; it is reported, not swallowed
        text = f"a validator raised {type(error).__name__}: {printable(str(error), limit=200)}"
        raise InvalidParameter([Fault((), text)]) from error


def _assignments(group: BaseModel, changes: Mapping[str, object], above: KeyPath) -> Iterator[tuple[KeyPath, object]]:
    """Yield each value with its path from the top."""
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
    """Return a copy of `data` with `value` at `path`; whether it may be there is for the validation to say."""
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
    """Return the validated values of a group."""
    return {name: getattr(group, name) for name in type(group).model_fields}
