"""Misplaced lines: keys that stand on another level than is meant, told once and then read as they are meant.

Only what could not stand where it does is moved, so a file that is right stays as it is. What is told of the rest of a
file is what would still be wrong with these lines indented.
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
from busflow.launchfile.yaml.scalar import plain_scalar
from busflow.launchfile.yaml.syntax import unspaced
from busflow.launchfile.yaml.value import Value
from busflow.text import counted
from busflow.validation.annotations import split, step_into

_GLUED = re.compile(r"([A-Za-z_]\w*):([^\s:/].*)")
"""A key whose value follows its colon without a space."""


def with_keys_in_place(file: Value, repeated: Repeated, problems: Problems) -> Value:
    """A launch file with each key on the level where it can stand, and once."""
    placer = _Placer(problems, repeated)
    tree, _ = placer.placed(file, LaunchKeys, None)
    for name, first, second in placer.repeated:  # where any key can stand
        placer.repeat(name, first, second)
    unsure = [path for path, each in tree.leaves() if each.key in placer.unsure]
    problems.left_out.update(unsure)
    # Which plugin is meant is not known, and so nothing of what the node should have.
    return without(tree, [path for path in unsure if path[-1:] == ("plugin",)])


@dataclass(frozen=True, slots=True)
class _Kind:
    """What a mapping may hold: the keys of a model, or any names, each with an entry."""

    keys: frozenset[str] | None = None
    """Of a model; None where any name may stand."""
    entry: _Kind | None = None
    """What each name has below it, where that is a mapping."""

    def may_hold(self, key: str, value: Value) -> bool:
        """Whether a key can stand there, as far as its level tells."""
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
        """Whether a key that stands elsewhere is meant for here."""
        if self.keys is not None:
            return key in self.keys
        known = self.entry.keys if self.entry is not None else None
        return known is not None and bool(value.members) and all(each in known for each in value.members)


def _kind(annotation: object) -> _Kind | None:
    """What a mapping of this type may hold; None where it is no mapping."""
    annotation, _ = split(annotation)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return _Kind(frozenset(annotation.model_fields))
    origin = get_origin(annotation)
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return _Kind(None, _kind(get_args(annotation)[-1]))
    return None


@dataclass(slots=True)
class _Placer:
    """Puts the keys of a file where they can stand, collecting what was wrong."""

    problems: Problems
    repeated: Repeated
    """Keys that stand twice, as far as they are not looked at yet."""
    unsure: list[Place | None] = field(default_factory=list[Place | None])
    """The keys whose value is one of two."""

    def placed(self, stated: Value, annotation: object, around: _Kind | None) -> tuple[Value, dict[str, Value]]:
        """A mapping with what belongs into it, and what is meant to stand beside it."""
        kind = _kind(annotation)
        stated = _spaced(stated, kind, self.problems) if kind is not None else stated
        if kind is None or not isinstance(stated.content, dict):
            return stated, {}
        tree, outside, owner = replace(stated, content={}), dict[str, Value](), KeyPath()
        displaced: dict[KeyPath, dict[str, Value]] = {}
        for key, value in self._in_order(stated):
            is_right = kind.may_hold(key, value)
            if not is_right or (value.content is None and owner):
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
        """What a key that stands twice states: two mappings are laid on each other, of other values the first holds."""
        self.problems.add(duplicate_key(name, first, second), left_out=())
        if first.content is None or (isinstance(first.content, dict) and isinstance(second.content, dict)):
            return replace(first, content=first.merged(second).content)
        self.unsure.append(first.key)
        return first

    def _in_order(self, stated: Value) -> list[tuple[str, Value]]:
        """The members of a mapping as its file has them, a key that stands twice too."""
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
    """The way to the mapping before a key that is meant to hold it; none where there is no such one.

    Args:
        tree: What stands before the key, on its level.
        annotation: The type of it.
        key: A key that cannot, or need not, stand there.
        value: What it states.
        last: Where the key before went, if this one can stand where it does.
    """
    path: KeyPath = ()
    open_ends: list[KeyPath] = []
    others: list[KeyPath] = []
    found = tree
    while found.members:
        step = list(found.members)[-1]
        path, found, annotation = (*path, step), found.members[step], step_into(annotation, step)[0]
        kind = _kind(annotation)
        if kind is None or key in found.members or not (found.content is None or isinstance(found.content, dict)):
            continue
        if found.content is None and (kind.keys is None or key in kind.keys) and kind.may_hold(key, value):
            open_ends.append(path)
        elif kind.surely_holds(key, value):
            others.append(path)
    if last is not None:  # it is sure only that it can go on where the one before went
        return last if last in others else ()
    return open_ends[-1] if open_ends else others[0] if others else ()


def _report_too_shallow(tree: Value, path: KeyPath, moved: dict[str, Value], problems: Problems) -> None:
    """Keys that are meant to stand below another one."""
    owner = tree.find(path)
    first = next(iter(moved.values()))
    if owner is None or owner.key is None or first.key is None:
        return
    there = [each.key.column for key, each in owner.members.items() if each.key is not None and key not in moved]
    more = (there[0] if there else owner.key.column + 2) - first.key.column
    if owner.key.line == first.key.line:
        fix = f"put what belongs to it into braces: {path[-1]}: {{…}}"
    else:
        by = f" by {counted(more, 'more space')}" if more > 0 else ""
        fix = f"indent {_lines(moved.values())}{by}, below {path[-1]}: (line {owner.key.line})"
    message = f"{_listed(moved)} must stand below {path[-1]}"
    problems.add(problem_at("misplaced-key", message, fix, key_origin(first)), left_out=())


def _spaced(stated: Value, kind: _Kind, problems: Problems) -> Value:
    """A mapping in which no key has its value glued to its colon."""
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
    """The value that is glued to its key."""
    try:
        content = plain_scalar(found[2])
    except ValueError:
        content = found[2]
    return Value(content, whole.origin, whole.key or whole.origin.place)


def _report_glued(found: re.Match[str], place: Place | None, value: Value, problems: Problems) -> None:
    message, fix = unspaced(found[1], found[2])
    problems.add(problem_at("yaml", message, fix, value.origin, place), left_out=())


def _position(member: Value) -> tuple[int, int]:
    return (member.key.line, member.key.column) if member.key is not None else (0, 0)


def _lines(values: Iterable[Value]) -> str:
    """The lines that keys and what is below them take."""
    first, last = 0, 0
    for value in values:
        places = [each.origin.place for _, each in value.leaves()] + [value.key]
        lines = [each.line for each in places if each is not None]
        first, last = min(first or lines[0], *lines), max(last, *lines)
    return f"lines {first} to {last}" if last > first else f"line {first}"


def _listed(names: Iterable[str]) -> str:
    """Names as a sentence has them, the first ones of many."""
    *some, last = list(names)
    if len(some) > 2:
        some, last = some[:2], f"{len(some) - 1} more"
    return f"{', '.join(some)} and {last}" if some else last
