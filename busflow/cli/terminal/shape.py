"""Shape: which fields a type has, and of what kind, so that a wrong name is found before any message comes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from busflow.interfaces.encoding.description import Count, IndividualDescription, fields_of, is_empty, types_in

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType


@dataclass(frozen=True, slots=True)
class Shape:
    """The kind of a value: text, a number, a message with its fields, or a sequence of one of these."""

    base: str
    """`float64`, `string`, or the name of a message type."""
    fields: Mapping[str, Shape] | None = None
    """Those of a message."""
    count: Count = Count.ONE
    size: int = 0
    """The length of a fixed array, the most of a bounded one."""

    @property
    def is_sequence(self) -> bool:
        """Whether it holds several values."""
        return self.count is not Count.ONE

    @property
    def item(self) -> Shape:
        """What a sequence holds."""
        return replace(self, count=Count.ONE, size=0)


def shape_of(type_: ForeignType) -> Shape | None:
    """The shape of a type's messages; None where it is described by JSON Schema, whose values may have several."""
    return _Shapes(types_in(type_.description)).of(type_.name) if type_.is_ros else None


@dataclass(frozen=True, slots=True)
class _Shapes:
    types: Mapping[str, IndividualDescription]
    made: dict[str, Shape] = field(default_factory=dict[str, Shape])

    def of(self, name: str) -> Shape:
        """The shape of a message type."""
        if name not in self.made:
            described = self.types[name]
            members = () if is_empty(described) else fields_of(described)
            fields = {
                each.name: replace(
                    self.of(each.base) if each.nested else Shape(each.base), count=each.count, size=each.size
                )
                for each in members
            }
            self.made[name] = Shape(name, fields)
        return self.made[name]
