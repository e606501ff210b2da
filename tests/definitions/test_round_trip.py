"""Definitions on their whole way: a file is read, becomes a class, and is written again as the same type."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from busflow.definitions.export import exported
from busflow.definitions.recorded import parse
from busflow.interfaces.action import ActionType, derived_types
from busflow.interfaces.encoding.description import rihs01
from busflow.interfaces.encoding.plain_reader import decoder_from_description
from busflow.interfaces.encoding.plain_writer import encoder_from_description
from busflow.interfaces.encoding.typesupport import TypeSupport
from busflow.interfaces.message import Message, ServiceType, constants_of
from tests.definitions.any_package import PACKAGES, Made, packages
from tests.definitions.test_library import write
from tests.interfaces.any_message import messages


def parts_of(cls: type[Any]) -> list[type[Message]]:
    if issubclass(cls, ServiceType):
        return [cls.Request, cls.Response]
    return [cls.Goal, cls.Result, cls.Feedback] if issubclass(cls, ActionType) else [cls]


def types_of(cls: type[Any]) -> list[Any]:
    """The types with a hash: a message or a service, and for an action its parts and those that are derived of it."""
    return [*parts_of(cls), *derived_types(cls)] if issubclass(cls, ActionType) else [cls]


@settings(suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large], deadline=None)
@given(packages(), st.data())
def test_definition_becomes_a_class_and_the_same_definition(files: dict[str, str], data: st.DataObject):
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        first = Made(write(folder / "src", files), folder)
        for cls in first.classes.values():
            for each in types_of(cls):
                described = first.library.description(each.__ros_name__)
                support = TypeSupport(each)
                assert (support.name, support.type_hash) == (each.__ros_name__, rihs01(described))
                if issubclass(each, Message):
                    assert rihs01(parse(support.name, support.definition)) == support.type_hash
            for part in parts_of(cls):
                check_bytes(part, data.draw(messages(part)))
        again = {
            f"{package}/{path}": text
            for package in PACKAGES
            if (classes := [cls for name, cls in first.classes.items() if name.startswith(f"{package}/")])
            for path, text in exported(package, classes, "MIT").items()
        }
        second = Made(write(folder / "out", again), folder)
        assert second.classes.keys() == first.classes.keys()
        for name, cls in second.classes.items():
            assert rihs01(second.library.description(name)) == rihs01(first.library.description(name))
            for one, other in zip(parts_of(first.classes[name]), parts_of(cls), strict=True):
                assert repr(one()) == repr(other())
                assert repr(constants_of(one)) == repr(constants_of(other))


def check_bytes(cls: type[Message], message: Message) -> None:
    """Compare the bytes of the class with those that its description gives, there and back."""
    support = TypeSupport(cls)
    for each in (message, cls()):
        data = support.encode(each)
        assert support.decode(data) == each
        values = decoder_from_description(support.description)(data)
        assert encoder_from_description(support.description)(values) == data
    assert encoder_from_description(support.description)({}) == support.encode(cls())
