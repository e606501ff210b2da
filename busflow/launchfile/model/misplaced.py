"""Misplaced lines: keys with wrong indentation, reported once and then read as if they were on the intended level.

Only a key that is not allowed where it stands is moved, so a correct file stays unchanged. The rest of the file is
checked as if these lines were indented correctly.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import get_args, get_origin

from pydantic import BaseModel

from busflow.errors import KeyPath, Place
from busflow.launchfile.model.key_faults import without
from busflow.launchfile.model.keys import LaunchKeys
from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.yaml.document import Repeated, duplicate_key
from busflow.launchfile.yaml.scalar import scalar_or_text
from busflow.launchfile.yaml.syntax import unspaced
from busflow.launchfile.yaml.value import Value
from busflow.text import counted
from busflow.validation.annotations import split, step_into

_GLUED = re.compile(r"([A-Za-z_]\w*):([^\s:/].*)")
"""Key and value without a space after the colon."""


def with_keys_in_place(file: Value, repeated: Repeated, problems: Problems) -> Value:
    """Return a launch file with each key on a level where it is allowed, and without repeated keys."""
    placer = _Placer(problems, repeated)
    tree, _ = placer.placed(file, LaunchKeys, None)
    for name, first, second in placer.repeated:  # in mappings whose keys are not placed, such as groups of parameters
        placer.repeat(name, first, second)
    unsure = [path for path, each in tree.leaves() if each.key in placer.unsure]
    problems.left_out.update(unsure)
    # A node whose plugin is stated twice cannot be checked: leave it out.
    return without(tree, [path for path in unsure if path[-1:] == ("plugin",)])


@dataclass(frozen=True, slots=True)
class _Kind:
    """Keys that a mapping allows: those of a model, or any name, often with a mapping of known keys as its value."""

    keys: frozenset[str] | None = None
    """Keys of a model; None if any name is allowed."""
    entry: _Kind | None = None
    """Kind of the mapping below each name; None if the value of a name is not a mapping."""

    def may_hold(self, key: str, value: Value) -> bool:
        """Return whether the mapping allows this key with this value.

        Below a name, a mapping fits if it has one of the keys known there, or none except `x-` keys, which are free.
        """
        if key.startswith("x-"):
            return True
        if self.keys is not None:
            return key in self.keys
        if self.entry is None or value.content is None:
            return True
        own = [each for each in value.members if not each.startswith("x-")]
        known = self.entry.keys
        return isinstance(value.content, dict) and (known is None or not own or any(each in known for each in own))

    def surely_holds(self, key: str, value: Value) -> bool:
        """Return whether a key that stands elsewhere certainly belongs here, by its name or by the keys below it."""
        if self.keys is not None:
            return key in self.keys
        known = self.entry.keys if self.entry is not None else None
        return known is not None and bool(value.members) and all(each in known for each in value.members)


def _kind(annotation: object) -> _Kind | None:
    """Return the kind of a mapping of this type; None if it is not a mapping."""
    annotation, _ = split(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return _Kind(frozenset(annotation.model_fields))
    origin = get_origin(annotation)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _Kind(None, _kind(get_args(annotation)[-1]))
    return None


@dataclass(slots=True)
class _Placer:
    """Moves the keys of a file to levels where they are allowed, and collects the problems."""

    problems: Problems
    repeated: Repeated
    """Repeated keys that are not handled yet."""
    unsure: list[Place | None] = field(default_factory=list[Place | None])
    """Places of keys with two different values."""

    def placed(self, stated: Value, annotation: object, around: _Kind | None) -> tuple[Value, dict[str, Value]]:
        """Return a mapping with the keys that belong in it, and the keys that belong one level up, beside it.

        Args:
            stated: The mapping as the file has it.
            annotation: Its type.
            around: The kind of the mapping one level up; None for a whole file.
        """
        kind = _kind(annotation)
        stated = _spaced(stated, kind, self.problems) if kind is not None else stated
        if kind is None or not isinstance(stated.content, dict):
            return stated, {}
        tree, outside, owner = replace(stated, content={}), dict[str, Value](), KeyPath()
        displaced: dict[KeyPath, dict[str, Value]] = {}
        for key, value in self._in_order(stated):
            is_right = kind.may_hold(key, value)
            if not is_right or (value.content is None and owner):  # one without a value may belong to the last owner
                owner = _intended_parent(tree, annotation, key, value, owner if is_right else None)
                displaced.setdefault(owner, {})[key] = value
            elif is_right:
                owner = ()
            if (first := tree.find((*owner, key))) is not None:
                tree = tree.with_member((*owner, key), self.repeat(key, first, value))
            elif not is_right and not owner and around is not None and around.surely_holds(key, value):
                outside[key] = value
            else:
                tree = tree.with_member((*owner, key), value)
        for path, moved in displaced.items():
            if path:
                _report_too_shallow(tree, path, moved, self.problems)
        return self._with_placed_members(tree, annotation, kind), outside

    def repeat(self, name: str, first: Value, second: Value) -> Value:
        """Report a repeated key and return its value: two mappings merged, otherwise the first value."""
        self.problems.add(duplicate_key(name, first, second), left_out=())
        if first.content is None or (isinstance(first.content, dict) and isinstance(second.content, dict)):
            return replace(first, content=first.merged(second).content)
        self.unsure.append(first.key)
        return first

    def _in_order(self, stated: Value) -> list[tuple[str, Value]]:
        """Return the members of a mapping in the order of the file, with every repeated key."""
        members = list(stated.members.items())
        again = [each for each in self.repeated if stated.members.get(each[0]) is each[1]]
        self.repeated = [each for each in self.repeated if each not in again]
        members += [(name, second) for name, _, second in again]
        return sorted(members, key=lambda member: _position(member[1]))

    def _with_placed_members(self, tree: Value, annotation: object, kind: _Kind) -> Value:
        members: dict[str, Value] = {}
        for key, value in tree.members.items():
            members[key], beside = self.placed(value, step_into(annotation, key)[0], kind)
            if beside and value.key is not None:
                origin = key_origin(next(iter(beside.values())))
                message = f"{_listed(beside)} must stand beside {key}, not below it"
                fix = f"begin {_lines(beside.values())} in the column of {key}: (line {value.key.line})"
                self.problems.add(problem_at("misplaced-key", message, fix, origin), left_out=())
            members |= {name: each for name, each in beside.items() if name not in members and name not in tree.members}
        return replace(tree, content=members)


def _intended_parent(tree: Value, annotation: object, key: str, value: Value, last: KeyPath | None) -> KeyPath:
    """Return the path of the preceding mapping that a key belongs in; empty if there is none.

    Args:
        tree: The entries before the key, on its level.
        annotation: The type of `tree`.
        key: A key that is not allowed there, or may belong elsewhere.
        value: Its value.
        last: Where the previous key was moved to, if this one is allowed where it stands; else None.
    """
    path: KeyPath = ()
    without_value: list[KeyPath] = []
    others: list[KeyPath] = []
    found = tree
    while found.members:
        step = list(found.members)[-1]
        path, found, annotation = (*path, step), found.members[step], step_into(annotation, step)[0]
        kind = _kind(annotation)
        if kind is None or key in found.members or not (found.content is None or isinstance(found.content, dict)):
            continue
        if found.content is None and (kind.keys is None or key in kind.keys) and kind.may_hold(key, value):
            without_value.append(path)
        elif kind.surely_holds(key, value):
            others.append(path)
    if last is not None:  # the key is allowed here: move it only along with the previous one
        return last if last in others else ()
    # The innermost key that still has no value; else the outermost mapping that certainly holds the key.
    return without_value[-1] if without_value else others[0] if others else ()


def _report_too_shallow(tree: Value, path: KeyPath, moved: dict[str, Value], problems: Problems) -> None:
    """Report keys that belong below another one."""
    owner = tree.find(path)
    first = next(iter(moved.values()))
    if owner is None or owner.key is None or first.key is None:
        return
    there = [each.key.column for key, each in owner.members.items() if each.key is not None and key not in moved]
    more = (there[0] if there else owner.key.column + 2) - first.key.column
    if owner.key.line == first.key.line:
        fix = f"put the keys of {path[-1]} into braces: {path[-1]}: {{…}}"
    else:
        by = f" by {counted(more, 'more space')}" if more > 0 else ""
        fix = f"indent {_lines(moved.values())}{by}, below {path[-1]}: (line {owner.key.line})"
    message = f"{_listed(moved)} must stand below {path[-1]}"
    problems.add(problem_at("misplaced-key", message, fix, key_origin(first)), left_out=())


def _spaced(stated: Value, kind: _Kind, problems: Problems) -> Value:
    """Return a mapping with `key:value` read as `key: value`, and report it."""
    if isinstance(stated.content, str):
        words = stated.content.split()
        glued = [found for found in map(_GLUED.fullmatch, words) if found is not None]
        fits = kind.entry is None and all(kind.keys is None or each[1] in kind.keys for each in glued)
        if not fits or not glued or len(glued) < len(words):
            return stated
        _report_glued(glued[0], stated.origin.place, stated, problems)
        return replace(stated, content={each[1]: _part(each, stated) for each in glued})
    members: dict[str, Value] = {}
    for key, value in stated.members.items():
        place, found = value.key, _GLUED.fullmatch(key) if value.content is None else None
        is_quoted = place is not None and place.excerpt[place.column - 1 : place.column] in {"'", '"'}
        if found is None or is_quoted or (kind.keys is not None and found[1] not in kind.keys):
            members.setdefault(key, value)
        else:
            _report_glued(found, place, value, problems)
            members.setdefault(found[1], _part(found, value))
    return replace(stated, content=members) if isinstance(stated.content, dict) else stated


def _part(found: re.Match[str], whole: Value) -> Value:
    """Return the value of `key:value`."""
    return Value(scalar_or_text(found[2]), whole.origin, whole.key or whole.origin.place)


def _report_glued(found: re.Match[str], place: Place | None, value: Value, problems: Problems) -> None:
    message, fix = unspaced(found[1], found[2])
    problems.add(problem_at("yaml", message, fix, value.origin, place), left_out=())


def _position(member: Value) -> tuple[int, int]:
    return (member.key.line, member.key.column) if member.key is not None else (0, 0)


def _lines(values: Iterable[Value]) -> str:
    """Name the lines of these keys and their values: `lines 3 to 5`."""
    first, last = 0, 0
    for value in values:
        places = [each.origin.place for _, each in value.leaves()] + [value.key]
        lines = [each.line for each in places if each is not None]
        first, last = min(first or lines[0], *lines), max(last, *lines)
    return f"lines {first} to {last}" if last > first else f"line {first}"


def _listed(names: Iterable[str]) -> str:
    """List names for a sentence; of many, the first two and a count."""
    *some, last = list(names)
    if len(some) > 2:
        some, last = some[:2], f"{len(some) - 1} more"
    return f"{', '.join(some)} and {last}" if some else last
