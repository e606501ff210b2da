"""`Value`: plain data with the origin of each part, so that problems can point there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, TypeAlias, cast

from busflow.errors import KeyPath, Place

Scalar: TypeAlias = str | int | float | bool | None


class StatedBy(StrEnum):
    """Source of a value."""

    FILE = "file"
    COMMAND_LINE = "command line"
    ENVIRONMENT = "environment"
    CALLER = "caller"  # Python code, by `args` or `overrides`
    DEFAULT = "default"


@dataclass(frozen=True, slots=True)
class Origin:
    """Place where a value was stated, and by which source.

    >>> str(Origin(StatedBy.FILE, Place("lab1.yaml", 12, 16)))
    'lab1.yaml:12:16'
    >>> str(Origin(StatedBy.FILE, Place("lab1.yaml", 12, 16), through=Origin(StatedBy.COMMAND_LINE)))
    'lab1.yaml:12:16, from command line'
    """

    source: StatedBy
    place: Place | None = None
    included_from: tuple[Place, ...] = ()
    through: Origin | None = None
    """The origin of the argument or variable that an expression at `place` took its value from."""

    @property
    def trail(self) -> tuple[Place, ...]:
        """The place and the `include` entries that led there; empty without a place."""
        return (self.place, *self.included_from) if self.place is not None else ()

    def __str__(self) -> str:
        here = str(self.place) if self.source is StatedBy.FILE and self.place else self.source.value
        return f"{here}, from {self.through}" if self.through else here


@dataclass(frozen=True, slots=True)
class StatedPath:
    """File or folder that a launch file names, with the place that names it."""

    path: Path
    origin: Origin


def on_command_line(text: str, start: int, width: int) -> Place:
    """Return the place of a part of a command line's text; `start` counts from 0."""
    return Place(StatedBy.COMMAND_LINE.value, 1, start + 1, max(1, width), text)


@dataclass(frozen=True, slots=True)
class Value:
    """A scalar, list or mapping, with its origin and, as a member of a mapping, the place of its key."""

    content: Scalar | list[Value] | dict[str, Value]
    origin: Origin
    key: Place | None = None

    @classmethod
    def of(cls, data: Any, origin: Origin) -> Value:
        """Make a value from plain data, all of one origin."""
        if isinstance(data, Mapping):
            items = cast("Mapping[object, object]", data).items()
            return cls({str(key): cls.of(each, origin) for key, each in items}, origin)
        if isinstance(data, (list, tuple)):
            return cls([cls.of(each, origin) for each in cast("list[object]", data)], origin)
        return cls(data, origin)

    @property
    def data(self) -> object:
        """The value as plain data."""
        if isinstance(self.content, dict):
            return {key: value.data for key, value in self.content.items()}
        if isinstance(self.content, list):
            return [value.data for value in self.content]
        return self.content

    @property
    def members(self) -> Mapping[str, Value]:
        """The members of a mapping; empty for anything else."""
        return self.content if isinstance(self.content, dict) else {}

    def section(self, key: str) -> Mapping[str, Value]:
        """Return the members of the mapping at `key`; empty if there is none."""
        found = self.members.get(key)
        return found.members if found is not None else {}

    def find(self, path: KeyPath) -> Value | None:
        """Return the value at `path` below this one, or None."""
        found: Value | None = self
        for step in path:
            if isinstance(found.content, dict):
                found = found.content.get(str(step))
            elif isinstance(found.content, list) and isinstance(step, int) and step < len(found.content):
                found = found.content[step]
            else:
                found = None
            if found is None:
                return None
        return found

    def followed(self, path: KeyPath) -> tuple[KeyPath, int]:
        """Return the path with list indices as numbers, and how many of its steps lead to a value or a possible one."""
        steps: KeyPath = ()
        for step in path:
            parent = self.find(steps)
            content = parent.content if parent is not None else None
            if isinstance(content, list) and (not str(step).isdecimal() or int(step) >= len(content)):
                break
            if content is not None and not isinstance(content, (list, dict)):
                break
            steps = (*steps, int(step) if isinstance(content, list) else step)
        return (*steps, *path[len(steps) :]), len(steps)

    def nearest(self, path: KeyPath) -> Value:
        """Return the value at `path`, or else its nearest stated parent."""
        for end in range(len(path), 0, -1):
            found = self.find(path[:end])
            if found is not None:
                return found
        return self

    def leaves(self, path: KeyPath = ()) -> Iterator[tuple[KeyPath, Value]]:
        """Yield each scalar and each empty list or mapping, with its path."""
        if isinstance(self.content, dict) and self.content:
            for key, value in self.content.items():
                yield from value.leaves((*path, key))
        elif isinstance(self.content, list) and self.content:
            for index, value in enumerate(self.content):
                yield from value.leaves((*path, index))
        else:
            yield path, self

    def with_member(self, path: KeyPath, value: Value) -> Value:
        """Return a copy with `value` at `path`; missing mappings on the way are made."""
        if not path:
            return replace(value, key=self.key or value.key)
        step, rest = path[0], path[1:]
        if isinstance(self.content, list) and isinstance(step, int) and 0 <= step < len(self.content):
            items = list(self.content)
            items[step] = items[step].with_member(rest, value)
            return replace(self, content=items)
        members = dict(self.members)
        inner = members.get(str(step)) or Value({}, value.origin, value.key)
        members[str(step)] = inner.with_member(rest, value)
        return replace(self, content=members)

    def without(self, path: KeyPath) -> Value:
        """Return a copy without the value at `path`; for the empty path, an empty mapping."""
        found = self.find(path[:1])
        if found is None or not path:
            return self if path else replace(self, content={})
        inner = found.without(path[1:]) if path[1:] else None
        if isinstance(self.content, list):
            items = [inner if n == path[0] else each for n, each in enumerate(self.content)]
            return replace(self, content=[each for each in items if each is not None])
        members = {key: inner if key == str(path[0]) else each for key, each in self.members.items()}
        return replace(self, content={key: each for key, each in members.items() if each is not None})

    def without_any(self, paths: Iterable[KeyPath]) -> Value:
        """Return a copy without the values at these paths; for a missing path, without its nearest stated parent."""
        tree = self
        # Remove the last items of a list first, so that the indices of the others stay right.
        for path in sorted(paths, key=lambda path: [f"{step:0>9}" for step in path], reverse=True):
            stated = next(path[:end] for end in range(len(path), -1, -1) if tree.find(path[:end]) is not None)
            tree = tree.without(stated)
        return tree

    def merged(self, over: Value) -> Value:
        """Return this value overridden by `over`: mappings merge key by key, everything else is replaced."""
        if not (isinstance(self.content, dict) and isinstance(over.content, dict)):
            return over
        members = dict(self.content)
        for key, value in over.content.items():
            members[key] = members[key].merged(value) if key in members else value
        return replace(over, content=members)
