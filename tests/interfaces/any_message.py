"""Strategies of hypothesis for messages of any class."""

import pkgutil
from functools import cache
from importlib import import_module

import pytest
from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

import busflow.msgs
from busflow.interfaces.fields import PRIMITIVES
from busflow.interfaces.message import ArrayKind, Message, fields_of, type_name

TYPES = [
    getattr(module, word)
    for package in pkgutil.iter_modules(busflow.msgs.__path__)
    for module in [import_module(f"busflow.msgs.{package.name}")]
    for word in module.__all__
]
MESSAGES = {type_name(cls): cls for cls in TYPES if issubclass(cls, Message)}


def values_of(field):
    """Values that a field can hold."""
    if not isinstance(field.base, str):
        items = messages(field.base)
    else:
        primitive, bound = PRIMITIVES[field.base], field.string_bound or 20
        if primitive.dtype and field.array is not ArrayKind.NONE:
            sizes = {ArrayKind.FIXED: (field.size, field.size), ArrayKind.BOUNDED: (0, field.size)}
            low, high = sizes.get(field.array, (0, 4))
            return st.integers(low, high).flatmap(lambda size: npst.arrays(primitive.dtype, size))
        items = {
            int: st.integers(primitive.low, primitive.high),
            float: st.floats(width=32 if field.base == "float32" else 64),
            bool: st.booleans(),
            str: st.text(st.characters(codec="utf-8"), max_size=min(bound, 5)),
        }[primitive.python]
    if field.array is ArrayKind.NONE:
        return items
    return st.lists(items, min_size=field.size if field.array is ArrayKind.FIXED else 0, max_size=field.size or 3)


@cache
def messages(cls):
    """Messages of a class, each field with a value that it can hold."""
    return st.builds(cls, **{field.name: values_of(field) for field in fields_of(cls)})


EVERY_KIND = {
    "control_msgs/action/FollowJointTrajectory_Goal",
    "example_interfaces/msg/WString",
    "rcl_interfaces/msg/ParameterValue",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/PointCloud2",
    "std_msgs/msg/Header",
}
"""Types with fields of every kind; the others, which combine the same kinds, belong to the long tests."""


def by_group(types):
    """The classes in groups, as a test's parameters: those with every kind of field, and all of each package."""
    packages = sorted({name.partition("/")[0] for name in types})
    return [
        pytest.param([types[name] for name in sorted(EVERY_KIND)], id="every kind of field"),
        *(
            pytest.param(
                [cls for name, cls in types.items() if name.startswith(f"{package}/")],
                id=package,
                marks=pytest.mark.long,
            )
            for package in packages
        ),
    ]
