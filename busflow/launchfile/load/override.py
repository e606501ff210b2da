"""Overrides of launch file values, from the command line (`--set nodes.talker.restart=always`)."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from busflow.errors import KeyPath, LaunchError, Problem
from busflow.launchfile.load.files import Files
from busflow.launchfile.model.keys import NodeKeys
from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.yaml.document import MAX_DEPTH, parse_value
from busflow.launchfile.yaml.value import StatedBy, Value, on_command_line
from busflow.text import did_you_mean
from busflow.validation.faults import dotted, shown

COMMAND_LINE = StatedBy.COMMAND_LINE.value
SETTABLE = (
    *("clock", "expect", "frames", "machines", "name", "network", "nodes", "packages", "processes", "programs"),
    *("qos", "record", "seed", "shutdown", "topics"),
)


@dataclass(frozen=True, slots=True)
class Override:
    """New value for one path of the description."""

    path: KeyPath
    value: Value


def _parsed(text: str) -> Override:
    """Parse the text of `--set`: a dotted path, `=`, a value.

    Raises:
        LaunchError: The text has another form, or the value is invalid.
    """
    path, sign, value = text.partition("=")
    steps = path.strip().split(".")
    if not sign or not all(steps) or len(steps) > MAX_DEPTH:
        fix = "write a path and a value: nodes.talker.parameters.rate_hz=50"
        raise LaunchError([Problem("bad-override", "this is not path=value", fix, on_command_line(text, 0, len(text)))])
    if not value:
        fix = f"for an empty text write {path}='\"\"'"
        raise LaunchError([Problem("bad-override", "there is no value", fix, on_command_line(text, len(text), 1))])
    found = parse_value(value, COMMAND_LINE, path + sign)
    return Override(tuple(steps), replace(found, key=on_command_line(text, 0, len(path))))


def parsed(texts: Iterable[str], problems: Problems) -> list[Override]:
    """Return the overrides that these texts of `--set` state; report those that are wrong."""
    found: list[Override] = []
    for text in texts:
        with problems.collecting():
            found.append(_parsed(text))
    return found


def with_parameter_files(changes: Iterable[Override], tree: Value, files: Files) -> Iterator[Override]:
    """Yield the overrides of a tree; each value of a file set as a node's `parameters_from` is one of its own."""
    for change in changes:
        is_files = len(change.path) == 3 and change.path[::2] == ("nodes", "parameters_from")
        node = _node(str(change.path[1]), list(tree.section("nodes"))) if is_files else None
        if node is None:
            yield change
            continue
        for stated in change.value.content if isinstance(change.value.content, list) else [change.value]:
            found = files.parameters(Path(str(stated.content)), stated, f"/{node}")
            if found is not None:
                yield from _each(("nodes", node, "parameters"), replace(found, key=change.value.key))


def _each(path: KeyPath, value: Value) -> Iterator[Override]:
    """Yield an override for each value of a mapping, so that what it does not state stays as it is."""
    if not (isinstance(value.content, dict) and value.content):
        yield Override(path, value)
        return
    for key, member in value.content.items():
        yield from _each((*path, key), replace(member, key=value.key))


def applied(tree: Value, changes: Iterable[Override], problems: Problems) -> Value:
    """Return the tree with these overrides applied; report those that do not fit."""
    for change in changes:
        tree, problem = _applied(tree, change)
        if problem is not None:
            problems.add(problem)
    return tree


def _applied(tree: Value, override: Override) -> tuple[Value, Problem | None]:
    """Return the tree with one override applied, or the tree and a problem."""
    path = override.path
    section, *_ = path
    if section not in SETTABLE:
        return tree, _unknown(override, f"{section} cannot be set", _instead(tree, path))
    if section == "topics" and len(path) > 1:
        path = ("topics", f"/{str(path[1]).lstrip('/')}", *path[2:])
    if section == "nodes" and len(path) > 1:
        nodes = tree.members.get("nodes")
        names = list(nodes.members) if nodes is not None else []
        found = _node(str(path[1]), names)
        if found is None:
            fix = did_you_mean(str(path[1]), names, none="write the node below `nodes:` in the file")
            return tree, _unknown(override, f"there is no node {path[1]}", fix)
        path = ("nodes", found, *path[2:])
        if "for_each" in path[2:3]:
            return tree, _unknown(override, "for_each has made its nodes already", "set a value of one of these nodes")
    path, end = tree.followed(path)
    if end < len(path):
        parent = tree.nearest(path[:end])
        what = shown(parent.data) + (f" of {len(parent.content)}" if isinstance(parent.content, list) else "")
        message = f"{dotted(path[:end])} is {what}; it has no {path[end]}"
        return tree, _unknown(override, message, f"set {dotted(path[:end])} itself")
    return tree.with_member(path, override.value), None


def _node(name: str, names: list[str]) -> str | None:
    """Return the key of a node; its namespace may be left out if its name is unique."""
    wanted = name.lstrip("/")
    if wanted in names:
        return wanted
    same = [each for each in names if each.rpartition("/")[2] == wanted]
    return same[0] if len(same) == 1 else None


def _instead(tree: Value, path: KeyPath) -> str:
    first, *rest = path
    nodes = tree.members.get("nodes")
    if rest and nodes is not None and _node(str(first), list(nodes.members)) is not None:
        within = rest if rest[0] in NodeKeys.model_fields else ("parameters", *rest)
        return f"write {dotted(('nodes', str(first).lstrip('/'), *within))}=…"
    if first == "args" and rest:
        return f"write {rest[0]}:=… without --set"
    return did_you_mean(str(first), SETTABLE)


def _unknown(override: Override, message: str, fix: str) -> Problem:
    return problem_at("unknown-override", message, fix, key_origin(override.value))
