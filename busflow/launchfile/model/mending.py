"""What is left of a launch file when what is wrong with it is left out, or read as it was surely meant."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from busflow.errors import Fault, KeyPath
from busflow.launchfile.model.key_faults import meant, wants_list
from busflow.launchfile.yaml.value import Value


def once(faults: Iterable[Fault], tree: Value) -> list[Fault]:
    """The faults without those of a further entry of the same `for_each`: the same key of the same line."""
    found: dict[object, Fault] = {}
    for fault in faults:
        place = tree.nearest(fault.path).key or tree.nearest(fault.path).origin.place
        found.setdefault((place, fault.code, fault.path[-1:]) if place is not None else fault, fault)
    return list(found.values())


def mended(tree: Value, faults: Iterable[Fault]) -> tuple[Value, list[KeyPath]]:
    """The tree without what is wrong, and where that was; with what is surely meant in its place."""
    wrong: list[KeyPath] = []
    lost: list[KeyPath] = []
    for fault in faults:
        found = tree.nearest(fault.path)
        key = meant(fault, found.content)
        if wants_list(fault) and isinstance(found.content, str):
            tree = tree.with_member(fault.path, replace(found, content=[replace(found, key=None)]))
            continue
        wrong.append(fault.path)
        if key is not None and tree.find(path := (*fault.path[:-1], key)) is None:
            tree = tree.with_member(path, found)
        else:
            lost.append(fault.path)
    return without(tree, wrong), lost


def without(tree: Value, paths: Iterable[KeyPath]) -> Value:
    """The tree without what is at these paths; without the whole node where its plugin is wrong."""
    return tree.without_any(path[:-1] if path[-3::2] == ("nodes", "plugin") else path for path in paths)
