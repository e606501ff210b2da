"""`TypeDefinition`: one message, service or action type as its file defines it, comments included."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

from busflow.errors import Place
from busflow.interfaces.encoding.description import (
    ACTION_NEEDS,
    SERVICE_EVENT_INFO,
    Field,
    IndividualDescription,
    action_types,
    constant,
    individual,
    service_types,
)
from busflow.interfaces.encoding.stated_values import Scalar


class Kind(StrEnum):
    """The kind of a type: the middle part of its name, the folder of its files, and their suffix."""

    MESSAGE = "msg"
    SERVICE = "srv"
    ACTION = "action"

    @property
    def noun(self) -> str:
        """The word for it in text for people."""
        return self.name.lower()

    @property
    def phrase(self) -> str:
        """The word with its article."""
        return "an action" if self is Kind.ACTION else f"a {self.noun}"

    @property
    def parts(self) -> tuple[str, ...]:
        """The suffixes of the messages that a file of this kind defines."""
        return _PARTS[self]


_PARTS = {
    Kind.MESSAGE: ("",),
    Kind.SERVICE: ("_Request", "_Response"),
    Kind.ACTION: ("_Goal", "_Result", "_Feedback"),
}


def kind_of(name: str) -> Kind | None:
    """Return the kind that the middle part of a full name states."""
    middle = name.split("/")[1:-1]
    return Kind(middle[0]) if len(middle) == 1 and middle[0] in list(Kind) else None


@dataclass(frozen=True, slots=True)
class DefinedField:
    """A field, its default as a value (None where none is stated) and its comment."""

    field: Field
    default: Scalar | tuple[Scalar, ...] | None
    comment: str
    place: Place
    """The place of its name."""
    type_place: Place


@dataclass(frozen=True, slots=True)
class DefinedConstant:
    """A constant."""

    name: str
    base: str
    value: Scalar
    text: str
    """The value as the file writes it."""
    comment: str
    place: Place


@dataclass(frozen=True, slots=True)
class MessageDefinition:
    """One message of a file: all of a `.msg` file, a half of a `.srv` file, a third of an `.action` file."""

    name: str
    """The full name: `my_msgs/srv/Grip_Request`."""
    comment: str
    fields: tuple[DefinedField, ...]
    constants: tuple[DefinedConstant, ...]

    def describe(self) -> IndividualDescription:
        """Return it in ROS 2's form."""
        lines = [each.place.line for each in self.fields]
        return individual(
            self.name,
            [each.field.describe() for each in self.fields],
            [constant(each.name, each.base, each.text, bisect(lines, each.place.line)) for each in self.constants],
        )


@dataclass(frozen=True, slots=True)
class TypeDefinition:
    """What one file defines."""

    name: str
    """The full name: `my_msgs/msg/Grip`."""
    kind: Kind
    comment: str
    parts: tuple[MessageDefinition, ...]

    @property
    def package(self) -> str:
        """The package."""
        return self.name.partition("/")[0]

    @property
    def short(self) -> str:
        """The last part of the name."""
        return self.name.rpartition("/")[2]

    def types(self) -> dict[str, IndividualDescription]:
        """Return its types by name, those too that ROS 2 derives from a service or an action."""
        derived: list[IndividualDescription] = []
        if self.kind is Kind.SERVICE:
            derived = service_types(self.name)
        elif self.kind is Kind.ACTION:
            derived = action_types(self.name)
        return {each["type_name"]: each for each in [*(part.describe() for part in self.parts), *derived]}

    def needs(self) -> Iterator[tuple[str, Place | None]]:
        """Yield the names of other types that it needs, with the place that names each."""
        for part in self.parts:
            yield from ((each.field.base, each.type_place) for each in part.fields if each.field.nested)
        if self.kind is Kind.SERVICE:
            yield SERVICE_EVENT_INFO, None
        elif self.kind is Kind.ACTION:
            yield from ((each, None) for each in ACTION_NEEDS)
