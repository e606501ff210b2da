"""Checks the keys of a launch file: reports wrong ones with a correction, and removes them."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import replace
from difflib import SequenceMatcher
from typing import cast, get_origin

from pydantic import ValidationError

from busflow.errors import Fault, KeyPath, LaunchError
from busflow.launchfile.model.keys import ORDERED, LaunchKeys, NodeKeys
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.model.problems import problems as located
from busflow.launchfile.model.section import Section
from busflow.launchfile.yaml.scalar import flow, flow_words
from busflow.launchfile.yaml.value import Value
from busflow.text import nearest, printable
from busflow.validation.annotations import at, split
from busflow.validation.faults import MOST_FAULTS, faults

_ASSIGNMENT = re.compile(r"([A-Za-z_/~][\w/~-]*)\s*:?=\s*(\S+)")
_ALIKE = 0.75
"""Similarity from which on an unknown key is read as the suggested one."""


def checked(tree: Value, problems: Problems) -> tuple[LaunchKeys, Value]:
    """Validate the keys of a launch file; report wrong ones and return the rest, as a model and as a tree.

    Raises:
        LaunchError: There are too many faults to go on.
    """
    first = True
    while True:
        data = tree.data
        try:
            return LaunchKeys.model_validate(data), tree
        except ValidationError as error:
            found = [_named(fault, tree) for fault in faults(error, LaunchKeys, data, noun="key")]
        # A key that is missing because it was wrong and removed is reported already.
        new_faults = [fault for fault in found if first or fault.code != "missing"]
        first = False
        problems.add(*located(_once(new_faults, tree), tree, noun="key"), left_out=())
        if len(found) >= MOST_FAULTS:
            raise LaunchError([])  # the rest would only repeat what is reported
        tree, lost = _corrected(tree, found)
        problems.left_out.update(lost)


def _named(fault: Fault, tree: Value) -> Fault:
    """Reword a fault for launch files; a key of a later version is not reported as a typo."""
    if not fault.path:
        message = fault.message.replace("the keys", "a launch file")
        return replace(fault, message=message, fix="write `key: value` lines, `nodes:` among them")
    message = fault.message.replace(" or null", "")  # null is the same as not stated
    fault = replace(fault, message=message.replace("RecordKeys", "a file such as run.mcap, or a mapping"))
    if fault.path[-2:] == ("restart", "policy"):  # mostly written as `restart: WORD`
        fault = replace(fault, message=fault.message.replace(".restart.policy", ".restart"))
    owner = _section(fault.path[:-1])
    if fault.code == "unknown" and owner is not None and fault.path[-1] in owner.later:
        message = f"{fault.message.removeprefix('unknown ')} is not in this version yet"
        return replace(fault, message=message, fix=owner.later[str(fault.path[-1])], code="later")
    stated = tree.find(fault.path)
    return replace(fault, fix=_instead(fault, owner, stated.data if stated is not None else None))


def _meant(fault: Fault, value: object) -> str | None:
    """Return the key that an unknown one is a misspelling of, if that key can have this value."""
    owner, written = _section(fault.path[:-1]), str(fault.path[-1]) if fault.path else ""
    if fault.code != "unknown" or owner is None:
        return None
    near = nearest(written, owner.model_fields)
    if near is None or SequenceMatcher(None, near, written.casefold()).ratio() < _ALIKE:
        return None
    path = (*fault.path[:-1], near)
    is_section = _section(path) is not None or get_origin(split(at(LaunchKeys, path)[0])[0]) is dict
    return near if isinstance(value, Mapping) or not is_section else None


def _wants_list(fault: Fault) -> bool:
    """Return whether the fault is that a list is required."""
    return fault.code == "type" and get_origin(split(at(LaunchKeys, fault.path)[0])[0]) is list


def _section(path: KeyPath) -> type[Section] | None:
    owner, _ = split(at(LaunchKeys, path)[0])
    return owner if isinstance(owner, type) and issubclass(owner, Section) else None


def _instead(fault: Fault, owner: type[Section] | None, value: object) -> str | None:
    """Return the fix: what to write instead."""
    key = str(fault.path[-1])
    if fault.code == "unknown" and owner is NodeKeys and (fault.fix or "").startswith("known"):
        return f"{fault.fix}; a parameter of the node stands below parameters:"
    if fault.code in {"type", "length"} and ORDERED in at(LaunchKeys, fault.path)[1]:
        return f"write the lowest and the highest value, such as {key}: [9.5, 10.5]"
    if fault.code != "type" or fault.fix is not None:
        return fault.fix
    wanted, _ = split(at(LaunchKeys, fault.path)[0])
    section = _section(fault.path)
    text: str | None = None
    if _wants_list(fault):
        text = f"{key}: {flow_words(value) if key == 'command' and isinstance(value, str) else f'[{flow(value)}]'}"
    elif section is None and get_origin(wanted) is not dict:
        return None
    elif isinstance(value, list):
        return _for_list(key, cast("list[object]", value))
    elif section is not None and _section(fault.path[:-1]) is None and key in section.model_fields:
        return f"write a name above it, and indent {key}: below that"
    elif isinstance(value, str) and (assignment := _ASSIGNMENT.fullmatch(value)):
        text = f"{assignment[1]}: {assignment[2]}"
    elif isinstance(value, str) and key in _WORDS:
        text = f"{key}: {_WORDS[key].format(value)}"
    elif len(fault.path) > 1 and fault.path[-2] in _ENTRIES and (isinstance(value, str) or fault.path[-2] == "args"):
        text = f"{key}: {_ENTRIES[str(fault.path[-2])].format(flow(value), _type(value))}"
    return f"write {printable(text, limit=100)}" if text is not None else None


_WORDS = {"depends_on": "{{{0}: started}}", "clock": "{{mode: {0}}}"}
"""By key, the full form of a mapping that was written as a single word."""

_ENTRIES = {"nodes": "{{plugin: {0}}}", "topics": "{{qos: {0}}}", "args": "{{type: {1}, default: {0}}}"}
"""By section, the full form of an entry that was written as a single value."""

_FIRST_KEYS = {"groups": "nodes", "machines": "connect", "nodes": "plugin", "programs": "command"}
"""By section, what each entry has below its name."""


def _for_list(key: str, items: list[object]) -> str | None:
    """Return the fix for a list where a mapping by name is required."""
    if key == "for_each":
        text = printable(f"{key}: {{item: {flow(items)}}}", limit=100)
        return f"write {text}, and ${{each.item}} where one is meant"
    if key in _FIRST_KEYS:
        return f"write each {key.removesuffix('s')}'s name instead of '-', and {_FIRST_KEYS[key]}: below it"
    words = [each for each in items if isinstance(each, str)]
    if key == "remap" and not words:  # in ROS 2's launch files a list of `from: …` and `to: …`
        ends = [cast("Mapping[str, object]", each) for each in items if isinstance(each, Mapping)]
        words = [f"{each['from']}:={each['to']}" for each in ends if {*each} == {"from", "to"}]
    if key == "depends_on" and len(words) == len(items):
        text = f"{key}: {{{', '.join(f'{each}: started' for each in words)}}}"
    elif key == "remap" and (pairs := [found for found in map(_ASSIGNMENT.fullmatch, words) if found]):
        text = f"{key}: {{{', '.join(f'{each[1]}: {each[2]}' for each in pairs)}}}"
    else:
        return "leave out the '-' before each" if items and all(isinstance(each, Mapping) for each in items) else None
    return f"write {printable(text, limit=100)}"


def _type(value: object) -> str:
    """Return the type of an argument with this default."""
    match value:
        case list():
            items = cast("list[object]", value)
            return f"list[{_type(items[0]) if items else 'float'}]"
        case bool() | int() | float():
            return type(value).__name__
        case _:
            return "str"


def _once(faults: Iterable[Fault], tree: Value) -> list[Fault]:
    """Remove repeated faults of one `for_each`: those with the same key on the same line."""
    found: dict[object, Fault] = {}
    for fault in faults:
        place = tree.nearest(fault.path).key or tree.nearest(fault.path).origin.place
        found.setdefault((place, fault.code, fault.path[-1:]) if place is not None else fault, fault)
    return list(found.values())


def _corrected(tree: Value, faults: Iterable[Fault]) -> tuple[Value, list[KeyPath]]:
    """Return the tree with wrong keys corrected or removed, and the paths that were removed."""
    wrong: list[KeyPath] = []
    lost: list[KeyPath] = []
    for fault in faults:
        found = tree.nearest(fault.path)
        key = _meant(fault, found.content)
        if _wants_list(fault) and isinstance(found.content, str):
            tree = tree.with_member(fault.path, replace(found, content=[replace(found, key=None)]))
            continue
        wrong.append(fault.path)
        if key is not None and tree.find(path := (*fault.path[:-1], key)) is None:
            tree = tree.with_member(path, found)
        else:
            lost.append(fault.path)
    return without(tree, wrong), lost


def without(tree: Value, paths: Iterable[KeyPath]) -> Value:
    """Return the tree without these paths; where a node's plugin is wrong, without the whole node."""
    return tree.without_any(path[:-1] if path[-3::2] == ("nodes", "plugin") else path for path in paths)
