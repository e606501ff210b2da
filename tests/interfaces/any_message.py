"""Strategies of hypothesis for messages of any class."""

from functools import cache

from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

from busflow.interfaces.fields import PRIMITIVES
from busflow.interfaces.message import ArrayKind, fields_of


def values_of(field):
    """Values that a field can hold."""
    if not isinstance(field.base, str):
        items = messages(field.base)
    else:
        primitive = PRIMITIVES[field.base]
        if primitive.dtype and field.array is not ArrayKind.NONE:
            sizes = {ArrayKind.FIXED: (field.size, field.size), ArrayKind.BOUNDED: (0, field.size)}
            low, high = sizes.get(field.array, (0, 4))
            return st.integers(low, high).flatmap(lambda size: npst.arrays(primitive.dtype, size))
        items = {
            int: st.integers(primitive.low, primitive.high),
            float: st.floats(width=32 if field.base == "float32" else 64),
            bool: st.booleans(),
            str: st.text(st.characters(codec="utf-8"), max_size=field.string_bound or 5),
        }[primitive.python]
    if field.array is ArrayKind.NONE:
        return items
    return st.lists(items, min_size=field.size if field.array is ArrayKind.FIXED else 0, max_size=field.size or 3)


@cache
def messages(cls):
    """Messages of a class, each field with a value that it can hold."""
    return st.builds(cls, **{field.name: values_of(field) for field in fields_of(cls)})
