"""Conversion of pydantic's errors: each becomes a `Fault` with reason and fix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from enum import Enum
from math import isfinite, isnan
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Union, cast, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from busflow.errors import Fault, KeyPath
from busflow.text import did_you_mean
from busflow.validation.annotations import Bounds, at, choices, split, step_into, type_word

MOST_FAULTS = 100
"""The maximum number of reported faults; a hostile file could have a hundred thousand."""

QUOTE_IT = "quote it: "
"""Begins the fix for a number or boolean in the place of a text."""

_NOUNS: dict[object, str] = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "text",
    Path: "a path",
    NoneType: "null",
}
_COMPARISONS = {
    "greater_than": ("gt", "greater than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
    "multiple_of": ("multiple_of", "a multiple of"),
}
_LENGTHS = {
    "too_short": ("min_length", "at least", "items"),
    "too_long": ("max_length", "at most", "items"),
    "string_too_short": ("min_length", "at least", "characters"),
    "string_too_long": ("max_length", "at most", "characters"),
}
_KINDS: dict[str, type] = {
    "int": int,
    "float": float,
    "bool": bool,
    "string": str,
    "list": list,
    "tuple": list,
    "dict": dict,
    "model": dict,
}
_YAML_1_1 = {"yes": "true", "on": "true", "y": "true", "no": "false", "off": "false", "n": "false"}


def faults(error: ValidationError, model: type[BaseModel], data: object, *, noun: str) -> tuple[Fault, ...]:
    """Return the faults of `data`, one per path, at most from the first `MOST_FAULTS` errors.

    Args:
        error: The error that `model` raised for `data`.
        model: The model that validated.
        data: The input; it distinguishes keys from pydantic's own steps, such as the member of a union.
        noun: The word for a key of the model: "parameter", "key".
    """
    errors = error.errors(include_url=False)[:MOST_FAULTS]
    found: dict[KeyPath, list[ErrorDetails]] = {}
    for each in errors:
        path, value = located(each, errors, model, data)
        found.setdefault(path, []).append({**each, "input": value})
    return tuple(_fault(path, several, model, noun) for path, several in found.items())


def plain(value: object) -> Any:
    """Convert a validated value to plain data, as in a file."""
    match value:
        case BaseModel():
            return {name: plain(getattr(value, name)) for name in type(value).model_fields}
        case Enum():
            return value.value
        case Mapping():
            return {str(plain(key)): plain(each) for key, each in cast("Mapping[object, object]", value).items()}
        case list() | tuple() | set() | frozenset():
            return [plain(each) for each in cast("Sequence[object]", value)]
        case bool() | int() | float() | str() | None:
            return value
        case _:
            return str(value)


def same(one: object, other: object) -> bool:
    """Return whether two plain values are written the same; NaN equals NaN, and 1 is neither 1.0 nor true.

    >>> same([float("nan"), 1], [float("nan"), 1]), same(1, 1.0)
    (True, False)
    """
    alike = type(one) is type(other)
    if isinstance(one, dict) and isinstance(other, dict):
        left, right = cast("dict[str, object]", one), cast("dict[str, object]", other)
        return left.keys() == right.keys() and all(same(left[key], right[key]) for key in left)
    if isinstance(one, list) and isinstance(other, list):
        lefts, rights = cast("list[object]", one), cast("list[object]", other)
        return len(lefts) == len(rights) and all(map(same, lefts, rights))
    if isinstance(one, float) and isinstance(other, float):
        return one == other or (isnan(one) and isnan(other))
    return alike and one == other


def shown(value: object) -> str:
    """Return a value as text for an error: kind and content, in YAML's spelling, cut short.

    >>> shown("fast"), shown(True), shown(None), shown([1])
    ("text 'fast'", 'true', 'null', 'a list')
    """
    match value:
        case None:
            return "null"
        case bool():
            return str(value).lower()
        case float():
            return repr(value) if isfinite(value) else f"{value:f}".replace("inf", ".inf").replace("nan", ".nan")
        case int():
            return repr(value) if abs(value) < 10**20 else "a number of more than 20 digits"
        case str():
            return f"text {value!r}" if len(value) <= 60 else f"text {value[:57]!r}…"
        case Mapping():
            return "a mapping"
        case list() | tuple():
            return "a list"
        case _:
            return f"a value of type {type(value).__name__}"


def dotted(path: KeyPath) -> str:
    """Return a path as text for people.

    >>> dotted(("joints", 0, "amplitude"))
    'joints[0].amplitude'
    """
    return "".join(f"[{step}]" if isinstance(step, int) else f".{step}" for step in path).removeprefix(".")


def located(
    error: ErrorDetails, errors: Sequence[ErrorDetails], model: type[BaseModel], data: object
) -> tuple[KeyPath, object]:
    """Return an error's location without pydantic's own steps, and the value there."""
    path: list[str | int] = []
    annotation: object = model
    location = error["loc"]
    for index, step in enumerate(location):
        if get_origin(split(annotation)[0]) in {Union, UnionType}:
            if len({each["loc"][index : index + 1] for each in errors if each["loc"][:index] == location[:index]}) > 1:
                return tuple(path), cast("object", data)  # no member fits, and the intended one is unknown
            annotation = None
            continue
        inner, _ = step_into(annotation, step)
        if isinstance(data, Mapping) and step in data:
            data = cast("Mapping[object, object]", data)[step]
        elif isinstance(data, (list, tuple)) and isinstance(step, int) and step < len(cast("list[object]", data)):
            data = cast("list[object]", data)[step]
        elif inner is None and error["type"] != "missing":
            continue
        else:
            data = None
        annotation = inner
        path.append(step)
    return tuple(path), error["input"]


def _fault(path: KeyPath, errors: Sequence[ErrorDetails], model: type[BaseModel], noun: str) -> Fault:
    """Create the fault at `path`; several errors at one path mean that no member of a union fits."""
    error, context = errors[0], errors[0].get("ctx", {})
    kind, value = error["type"], error["input"]
    name = dotted(path) or f"the {noun}s"
    annotation, metadata = at(model, path)
    if kind in {"missing", "extra_forbidden"} and path:
        return _presence_fault(kind, path, model, noun)
    if len(errors) == 1 and kind in _COMPARISONS:
        limit, phrase = _COMPARISONS[kind]
        return Fault(
            path,
            f"{name} must be {phrase} {context[limit]:.15g}, got {shown(value)}",
            f"allowed: {Bounds.of(metadata)}",
            "range",
        )
    if len(errors) == 1 and kind in _LENGTHS:
        limit, phrase, unit = _LENGTHS[kind]
        has = len(cast("Sequence[object]", value))
        unit = unit.removesuffix("s") if context[limit] == 1 else unit
        return Fault(path, f"{name} must have {phrase} {context[limit]} {unit}, has {has}", None, "length")
    if kind == "string_pattern_mismatch":
        return Fault(path, f"{name} must match the pattern {context['pattern']}, got {shown(value)}")
    if kind in {"value_error", "assertion_error"}:
        return Fault(path, f"{dotted(path)}: {context['error']}" if path else str(context["error"]))
    if kind == "finite_number":
        return Fault(path, f"{name} must be a finite number, got {shown(value)}", None, "range")
    if kind == "union_tag_invalid":
        key, tag = context["discriminator"].strip("'"), str(context["tag"])
        return Fault(
            (*path, key),
            f"{dotted((*path, key))} must be one of {context['expected_tags']}, got {shown(tag)}",
            None,
            "choice",
        )
    allowed = choices(split(annotation)[0])
    if allowed:
        expected = f"one of {', '.join(str(each) for each in allowed)}"
        fix = did_you_mean(value, map(str, allowed)) if isinstance(value, str) else None
        return Fault(path, f"{name} must be {expected}, got {shown(value)}", fix, "choice")
    annotation = annotation or _KINDS.get(kind.partition("_")[0])
    return Fault(path, f"{name} must be {_noun(annotation)}, got {shown(value)}", _remedy(annotation, value), "type")


def _presence_fault(kind: str, path: KeyPath, model: type[BaseModel], noun: str) -> Fault:
    """Create the fault of a missing or an unknown key."""
    parent, _ = split(at(model, path[:-1])[0])
    if kind == "missing" and get_origin(parent) is tuple:
        size = len(get_args(parent))
        return Fault(path[:-1], f"{dotted(path[:-1])} must have {size} items", None, "length")
    if kind == "extra_forbidden":
        known = parent.model_fields if isinstance(parent, type) and issubclass(parent, BaseModel) else None
        fix = None if known is None else did_you_mean(str(path[-1]), known, none=f"leave it out: there are no {noun}s")
        outer, *inner = str(path[-1]).split(".")
        if inner and at(model, (*path[:-1], outer, *inner))[0] is not None:
            fix = f"write {outer}: {{{': {'.join(inner)}: …{'}' * len(inner)}"
        return Fault(path, f"unknown {noun} {dotted(path)}", fix, "unknown")
    allowed = choices(split(at(model, path)[0])[0])
    word = f"one of {', '.join(map(str, allowed))}" if allowed else type_word(at(model, path)[0])
    return Fault(path, f"{noun} {dotted(path)} is required", f"add `{path[-1]}:` with a value ({word})", "missing")


def _noun(annotation: object, kind: str = "a mapping") -> str:
    """Return the words for an annotation that follow "must be"; a model is a `kind`, or its name."""
    if annotation is None:
        return "something else"
    if get_origin(annotation) is Annotated:
        annotation = get_args(annotation)[0]
    if get_origin(annotation) in {Union, UnionType}:
        return " or ".join(dict.fromkeys(_noun(each, kind="") for each in get_args(annotation)))
    if annotation in _NOUNS:
        return _NOUNS[annotation]
    origin = get_origin(annotation) or annotation
    if not isinstance(origin, type) or not issubclass(origin, (BaseModel, Mapping, list, tuple, set, frozenset)):
        return type_word(annotation)
    if issubclass(origin, BaseModel):
        return kind or type_word(annotation)
    if issubclass(origin, Mapping):
        return "a mapping"
    simple = all(each in _NOUNS or each is Ellipsis for each in get_args(annotation))
    return f"a {type_word(annotation)}" if simple and get_args(annotation) else "a list"


def _remedy(annotation: object, value: object) -> str | None:
    """Return what to write instead, if the value shows the intention."""
    wanted, _ = split(annotation)
    if wanted is bool and isinstance(value, str) and value.lower() in _YAML_1_1:
        return f"write {_YAML_1_1[value.lower()]}"
    if wanted is str and isinstance(value, (bool, int, float)):
        return f'{QUOTE_IT}"{plain(value) if not isinstance(value, bool) else str(value).lower()}"'
    if wanted is int and isinstance(value, float) and value.is_integer() and abs(value) < 2**53:
        return f"write {int(value)}"
    if wanted in {int, float} and isinstance(value, str):
        try:
            number = float(value)
        except ValueError:
            return None
        if not isfinite(number):  # YAML has a dot before these words
            return f"write {shown(number)}" if wanted is float else None
        return f"write {value.replace('_', '')}" if "_" in value else "remove the quotes"
    return None
