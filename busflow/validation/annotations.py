"""Type annotations: their name, range and choices, access to nested ones, and strict scalars."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from enum import Enum
from fractions import Fraction
from itertools import chain
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Union, cast, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MultipleOf
from pydantic import BaseModel, ConfigDict, GetCoreSchemaHandler
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticKnownError, core_schema

from busflow.errors import InvalidDeclaration, KeyPath
from busflow.text import printable
from busflow.validation.as_written import written_annotations

_VALUES = (bool, int, float, complex, str, bytes, list, tuple, dict, set, NoneType, Enum, FieldInfo, BaseModel)


EXACT = 2**53
"""Up to here a float has the value of every integer."""
_LARGEST = sys.float_info.max
"""An integer beyond this has no nearest float, and pydantic refuses it."""


class Bounds(NamedTuple):
    """The range that an annotation allows.

    >>> str(Bounds(minimum=0, exclusive_minimum=True, maximum=3))
    'greater than 0, at most 3'
    """

    minimum: float | None = None
    maximum: float | None = None
    exclusive_minimum: bool = False
    exclusive_maximum: bool = False
    step: float | None = None

    @classmethod
    def of(cls, metadata: Sequence[object]) -> Bounds:
        """Return the range stated in an annotation's metadata."""
        stated: dict[str, Any] = {}
        for each in metadata:
            match each:
                case Gt(limit):
                    stated |= {"minimum": limit, "exclusive_minimum": True}
                case Ge(limit):
                    stated |= {"minimum": limit, "exclusive_minimum": False}
                case Lt(limit):
                    stated |= {"maximum": limit, "exclusive_maximum": True}
                case Le(limit):
                    stated |= {"maximum": limit, "exclusive_maximum": False}
                case MultipleOf(step):
                    stated |= {"step": step}
                case _:
                    pass
        return cls(**stated).by_steps()

    def by_steps(self) -> Bounds:
        """Return the range from its first to its last multiple of the step, as ROS 2 states one.

        >>> str(Bounds(minimum=1, maximum=9, exclusive_maximum=True, step=2).by_steps())
        'at least 2, at most 8, a multiple of 2'
        """
        if not self.step:
            return self
        low = _multiple(self.minimum, self.step, excluded=self.exclusive_minimum, into=1)
        high = _multiple(self.maximum, self.step, excluded=self.exclusive_maximum, into=-1)
        return Bounds(low, high, step=self.step)

    def __str__(self) -> str:
        parts: list[str] = []
        if self.minimum is not None:
            parts.append(f"{'greater than' if self.exclusive_minimum else 'at least'} {self.minimum:.15g}")
        if self.maximum is not None:
            parts.append(f"{'less than' if self.exclusive_maximum else 'at most'} {self.maximum:.15g}")
        if self.step is not None:
            parts.append(f"a multiple of {self.step:.15g}")
        return ", ".join(parts)


def _multiple(limit: float | None, step: float, *, excluded: bool, into: int) -> float | None:
    """Return the outermost multiple of `step` within a limit; `into` is 1 at the lower end and -1 at the upper."""
    if limit is None or math.isinf(limit):
        return limit
    each = Fraction(str(step))  # 0.1 as it is written, or the third step would be 0.30000000000000004
    steps = Fraction(str(limit)) / each
    count = into * math.ceil(into * steps)
    found = (count + into if excluded and count == steps else count) * each
    return int(found) if isinstance(limit, int) and isinstance(step, int) else float(found)


UNBOUNDED = Bounds()


def strict_scalars(schema: Any, resolve: Callable[[Any], Any]) -> Any:
    """Return a core schema that does not convert numbers, booleans and texts into each other.

    pydantic's own strict mode would also refuse the forms of YAML: a list for a tuple, a text for an enum or a path.

    Args:
        schema: The core schema of a model.
        resolve: Returns the schema of a reference.
    """
    kind = schema.get("type")
    if kind == "definition-ref" and resolve(schema)["type"] == "enum":
        schema = {key: value for key, value in resolve(schema).items() if key != "ref"}
        kind = "enum"
    if kind in {"int", "float", "bool", "str"}:
        first = _exact if kind == "float" else python_scalar
        return core_schema.no_info_before_validator_function(first, cast("Any", {**schema, "strict": True}))
    if kind in {"enum", "literal"}:
        return _strict_choice(schema)
    if kind == "function-before" and schema["function"]["function"] in (python_scalar, _exact):
        return schema  # already done for a nested model of the same kind
    changed = dict(schema)
    for key in (
        "schema",
        "values_schema",
        "lax_schema",
        "python_schema",
        "items_schema",
        "choices",
        "fields",
    ):
        if key in changed:
            changed[key] = _each_strict(changed[key], resolve)
    return changed


def python_scalar(value: object) -> object:
    """Convert a numpy scalar to a Python number; return any other value unchanged."""
    return cast("Any", value).item() if type(value).__module__ == "numpy" and hasattr(value, "item") else value


def split(annotation: object) -> tuple[object, tuple[object, ...]]:
    """Return an annotation without `Annotated` and `| None`, and its metadata."""
    metadata: tuple[object, ...] = ()
    while True:
        origin, arguments = get_origin(annotation), get_args(annotation)
        present = [each for each in arguments if each is not NoneType]
        if origin is Annotated:
            stated = (each.metadata if isinstance(each, FieldInfo) else [each] for each in arguments[1:])
            annotation, metadata = arguments[0], (*metadata, *chain.from_iterable(stated))
        elif origin in {Union, UnionType} and len(present) == 1:
            annotation = present[0]
        else:
            return annotation, metadata


def choices(annotation: object) -> tuple[object, ...] | None:
    """Return the values that an enum or a literal allows, as plain data; None for any other type."""
    if get_origin(annotation) is Literal:
        return get_args(annotation)
    if isinstance(annotation, type) and issubclass(annotation, Enum):
        # An enum may have members that only remote peers use; they cannot be chosen.
        offered: Callable[[], list[Enum]] = getattr(annotation, "__offered__", lambda: list(annotation))
        return tuple(member.value for member in offered())
    return None


def type_word(annotation: object) -> str:
    """Return a type as a user writes it.

    >>> type_word(list[float]), type_word(int | None), type_word(Literal["a", "b"]), type_word(Path)
    ('list[float]', 'int or null', 'str', 'path')
    """
    origin, arguments = get_origin(annotation), get_args(annotation)
    allowed = choices(annotation)
    if allowed:
        return " or ".join(sorted({type(each).__name__ for each in allowed}))
    if origin is Annotated:
        return type_word(arguments[0])
    if origin in {Union, UnionType}:
        return " or ".join(dict.fromkeys(type_word(each) for each in arguments))
    if isinstance(origin, type):
        members = dict.fromkeys(type_word(each) for each in arguments if each is not Ellipsis)
        return f"{'dict' if issubclass(origin, Mapping) else 'list'}[{', '.join(members)}]"
    if annotation is NoneType:
        return "null"
    return "path" if annotation is Path else getattr(annotation, "__name__", str(annotation))


def at(model: type[BaseModel], path: KeyPath) -> tuple[object, tuple[object, ...]]:
    """Return the annotation and metadata at `path`; None if unknown."""
    annotation: object = model
    metadata: tuple[object, ...] = ()
    for step in path:
        annotation, metadata = step_into(annotation, step)
    return annotation, metadata


def step_into(annotation: object, step: str | int) -> tuple[object, tuple[object, ...]]:
    """Return the annotation and metadata one step inside an annotation; None if unknown."""
    annotation, _ = split(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        fields = annotation.model_fields
        info = fields.get(str(step)) or next((each for each in fields.values() if each.alias == step), None)
        return (None, ()) if info is None else _with_metadata(info.annotation, info.metadata)
    arguments = [each for each in get_args(annotation) if each is not Ellipsis]
    origin = get_origin(annotation)
    if not isinstance(origin, type) or origin is UnionType or not arguments:
        return None, ()
    if issubclass(origin, Mapping):
        return _with_metadata(arguments[-1], ())
    fixed = isinstance(step, int) and step < len(arguments)
    return _with_metadata(arguments[cast("int", step) if fixed else -1], ())


def _each_strict(schemas: Any, resolve: Callable[[Any], Any]) -> Any:
    """Apply `strict_scalars` to a schema, or to each of a list or mapping of schemas, some with a label."""
    match schemas:
        case {"type": str()}:
            return strict_scalars(schemas, resolve)
        case dict():
            return {key: _each_strict(each, resolve) for key, each in cast("dict[str, Any]", schemas).items()}
        case list() | tuple():  # of schemas, or a schema with its label
            several = cast("list[Any]", schemas)
            return type(several)(_each_strict(each, resolve) for each in several)
        case _:
            return schemas


def _exact(value: object) -> object:
    """Return the value of a field that is a float; refuse an integer that no float has as its value."""
    value = python_scalar(value)
    if type(value) is int and EXACT < abs(value) <= _LARGEST and float(value) != value:
        shown = printable(value, limit=40)
        raise ValueError(f"no float is {shown}; write the nearest, {float(value)}, or make it a whole number")
    return value


def _strict_choice(schema: Any) -> Any:
    """Return a schema that refuses `true` and `1.0` for the choice 1, which they equal in Python."""
    members: list[object] = schema["members"] if schema["type"] == "enum" else schema["expected"]
    types: set[type] = {type(each.value if isinstance(each, Enum) else each) for each in members}

    def check(value: object) -> object:
        value = python_scalar(value)
        if type(value) in {bool, float} and type(value) not in types:
            raise PydanticKnownError("literal_error", {"expected": ""})
        return value

    # A choice among texts needs no check, and pydantic forbids one on the discriminator of a union.
    return schema if types == {str} else core_schema.no_info_before_validator_function(check, schema)


def _with_metadata(annotation: object, metadata: Sequence[object]) -> tuple[object, tuple[object, ...]]:
    return annotation, (*split(annotation)[1], *metadata)


def refuse_bare(cls: type[BaseModel]) -> None:
    """Refuse a class attribute without annotation, which would not become a field.

    Raises:
        InvalidDeclaration: the class has one; the error says how to write it.
    """
    annotated = {*written_annotations(cls), *cls.__class_vars__, "model_config"}
    for name, value in vars(cls).items():
        if name.startswith("_") or name in annotated or not isinstance(value, _VALUES):
            continue
        plain = isinstance(value, bool | int | float | str)
        kind, shown = (type(value).__name__, printable(repr(value), limit=40)) if plain else ("…", "…")
        raise InvalidDeclaration(
            f"{cls.__name__}.{name} has no annotation: write {name}: {kind} = {shown}, "
            f"or {name}: ClassVar[{kind}] = {shown} where it is no field"
        )


class StrictModel(BaseModel):
    """A frozen model that refuses unknown keys and does not convert numbers, booleans and texts into each other."""

    model_config: ClassVar[ConfigDict] = ConfigDict(
        frozen=True, extra="forbid", validate_default=True, protected_namespaces=()
    )

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return strict_scalars(handler(source), handler.resolve_ref_schema)
