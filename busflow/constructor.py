"""The constructors of message classes, written per class so that plain values need no detour through pydantic.

`Imu(header=…)` with values that already are what the message will hold only has to see that they are; that
takes two thirds of the time of pydantic's general way. Anything else (an integer for a float, a list for an
array, a mistake) goes that way, which converts or explains it. Both accept the same and make the same message.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from keyword import iskeyword
from typing import Any

import numpy as np
from pydantic import BaseModel

from busflow.arrays import frozen
from busflow.fields import PRIMITIVES, ArrayKind, FieldType, round_float32

_FLOAT32_LIMIT = 3.4028235677973366e38  # numbers beyond would round to infinity

_MISSING = object()
_slots: Any = BaseModel
_WORDS: dict[str, Any] = {
    # A field may have any other name, `type` too: only names of ours begin with an underscore.
    "_type": type,
    "_len": len,
    "_int": int,
    "_float": float,
    "_str": str,
    "_bytes": bytes,
    "_ndarray": np.ndarray,
    "_frozen": frozen,
    "_round": round_float32,
    "_missing": _MISSING,
    "_fill": vars(BaseModel)["__dict__"].__set__,
    "_set": _slots.__pydantic_fields_set__.__set__,
    "_extra": _slots.__pydantic_extra__.__set__,
    "_private": _slots.__pydantic_private__.__set__,
}


def constructor(cls: type[BaseModel], fields: Sequence[FieldType]) -> Callable[..., None]:
    """An `__init__` for `cls`, whose fields ROS can describe and which has no validators of its own."""
    words = _WORDS | {"_validate": cls.__pydantic_validator__.validate_python, "_names": {each.name for each in fields}}
    arguments: list[str] = []
    conditions: list[str] = []
    values: list[str] = []
    for index, field in enumerate(fields):
        if iskeyword(field.name) or not field.name.isidentifier():
            raise ValueError(f"{field.name!r} cannot be an argument")
        words[f"_default{index}"] = _MISSING if field.default is None else field.default
        words[f"_class{index}"] = _class_of(field)
        arguments.append(f"{field.name}=_default{index}")
        condition, value = _written(field, f"_default{index}", f"_class{index}")
        conditions.append(condition)
        values.append(f"{field.name!r}: {value}")
    given = ", ".join([*(f"{each.name!r}: {each.name}" for each in fields), "**_unknown"])
    if any(each.default is None for each in fields):
        given = f"name: each for name, each in {{{given}}}.items() if each is not _missing"
    source = f"""
def __init__(_self, /, {"*, " if fields else ""}{", ".join([*arguments, "**_unknown"])}):
    if {" and ".join([*conditions, "not _unknown"])}:
        _fill(_self, {{{", ".join(values)}}})
        _set(_self, _names)
        _extra(_self, None)
        _private(_self, None)
    else:
        _validate({{{given}}}, self_instance=_self)
"""
    made: dict[str, Any] = {}
    # The text consists of field names, checked above, and of this file's own words; no value gets into it.
    exec(compile(source, f"<constructor of {cls.__name__}>", "exec"), words, made)  # noqa: S102 - as dataclasses do
    return made["__init__"]


def _class_of(field: FieldType) -> Any:
    """What the type of a plain value is compared with: a message class, or the type of an array's items."""
    if not isinstance(field.base, str):
        return field.base
    dtype = PRIMITIVES[field.base].dtype
    return None if dtype is None else np.dtype(dtype)


def _written(field: FieldType, default: str, kind: str) -> tuple[str, str]:
    """As source code: whether the field's argument can be taken, and the value to keep of it."""
    name = field.name
    primitive = PRIMITIVES[field.base] if isinstance(field.base, str) else None
    if field.array is not ArrayKind.NONE:
        if primitive is None or primitive.dtype is None:
            return f"{name} is {default}", name
        length = {
            ArrayKind.FIXED: f" and _len({name}) == {field.size}",
            ArrayKind.BOUNDED: f" and _len({name}) <= {field.size}",
        }.get(field.array, "")
        right = f"_type({name}) is _ndarray and {name}.dtype is {kind} and {name}.ndim == 1{length}"
        kept = f"{name} if {name} is {default} or _type({name}.base) is _bytes else _frozen({name})"
        return f"({name} is {default} or {right})", kept
    if primitive is None:
        return f"_type({name}) is {kind}", name
    if primitive.python is bool:
        return f"({name} is True or {name} is False)", name
    condition = f"_type({name}) is _{primitive.python.__name__}"
    if primitive.python is int:
        return f"{condition} and {primitive.low} <= {name} <= {primitive.high}", name
    if primitive.python is str:
        bound = f" and _len({name}) <= {field.string_bound}" if field.string_bound is not None else ""
        return f"{condition} and {name}.isascii(){bound}", name
    if primitive.name == "float32":
        return f"{condition} and -{_FLOAT32_LIMIT!r} < {name} < {_FLOAT32_LIMIT!r}", f"_round({name})"
    return condition, name
