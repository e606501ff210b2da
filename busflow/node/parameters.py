"""`Parameters`: what a node can be told, declared as a pydantic model, strict about types and ranges."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeAlias, TypeVar, cast

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from busflow.errors import Fault, InvalidParameter
from busflow.text import did_you_mean
from busflow.validation.annotations import UNBOUNDED, Bounds, StrictModel, choices, refuse_bare, split, type_word
from busflow.validation.faults import faults, plain

T = TypeVar("T")
P = TypeVar("P", bound="Parameters")


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
    """The parameters that `data` states, defaults filled in.

    Raises:
        InvalidParameter: With every fault of `data`, not the first alone.
    """
    try:
        return cls.model_validate(data, by_name=True)
    except ValidationError as error:
        raise InvalidParameter(faults(error, cls, data, noun="parameter")) from None


def describe(cls: type[Parameters]) -> tuple[ParameterInfo, ...]:
    """Each parameter of `cls` in the order of declaration, nested ones flattened to dotted names."""
    cls.model_rebuild()  # a no-op unless the class names a type that was defined after it
    return tuple(_rows(cls, "", {}, read_only=False))


def value_of(parameters: BaseModel, name: str) -> Any:
    """What a dotted name stands for, as plain data; None inside an optional group that is not there."""
    found: Any = parameters
    for step in name.split("."):
        found = getattr(found, step, None)
    return plain(found)


def unknown(name: str, known: Iterable[str]) -> InvalidParameter:
    """The error that a name is no parameter, with the nearest one that is."""
    fix = did_you_mean(name, known)
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
    """The default as plain data; None where there is none or it depends on the other fields."""
    if info.is_required() or info.default_factory_takes_validated_data:
        return None
    return plain(info.get_default(call_default_factory=True))
