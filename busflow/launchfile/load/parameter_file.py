"""Parameter files in ROS 2's form: sections that name nodes, each with its parameters below `ros__parameters:`.

Such a file is data alone, as ROS 2 and `busflow param dump` write it: `${` in it is text. A file without
`ros__parameters` holds the parameters of the node that names it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import reduce
from typing import Any, NoReturn

import yaml

from busflow.bus.names import node_name_fault
from busflow.errors import LaunchError
from busflow.launchfile.model.problems import key_origin, problem_at
from busflow.launchfile.yaml.document import MAX_DEPTH
from busflow.launchfile.yaml.scalar import written
from busflow.launchfile.yaml.value import Origin, Value
from busflow.text import did_you_mean

_SECTION = "ros__parameters"
_WILDCARDS = ("*", "**")
_MEANING = "* stands for one part, ** for any number"


def names_nodes(file: Value) -> bool:
    """Return whether a parameter file has ROS 2's form."""
    return _SECTION in file.members or any(map(names_nodes, file.members.values()))


def of_node(file: Value, node: str, stated: Origin) -> Value:
    """Return the parameters of one node from a file in ROS 2's form, or the whole of any other file.

    As in ROS 2, a section's name is that of a node, with `*` for one part of it and `**` for any number of parts. Of
    several sections that match the node the later one wins, value by value.

    Args:
        file: The content of the file.
        node: The full name of the node.
        stated: The origin of the file's name, where a file without a section for the node is reported.

    Raises:
        LaunchError: The file has no section for the node, or a section is wrong.
    """
    if not names_nodes(file):
        for key, member in file.members.items():
            if key.startswith("/"):  # no parameter has such a name
                _refuse(f"{_SECTION}: is missing below {key}", f"write the parameters below {_SECTION}:", member)
        return file
    sections = list(_sections(file, ""))
    found = [section for name, section in sections if _matches(name, node)]
    if not found:
        path = file.origin.place.file if file.origin.place is not None else "the file"
        names = [name for name, _ in sections if "*" not in name]
        fix = did_you_mean(node, names, none=f"in the name of a section {_MEANING}")
        raise LaunchError([problem_at("no-section", f"{path} has no parameters for {node}", fix, stated)])
    return reduce(Value.merged, found)


def text_for(node: str, parameters: Mapping[str, Any]) -> str:
    """Write the parameters of a node, by its full name, in ROS 2's form."""
    return yaml.dump({node: {_SECTION: parameters}}, Dumper=_Dumper, allow_unicode=False)


class _Dumper(yaml.SafeDumper):
    """YAML's writer, which quotes a text unless every version of YAML reads it as that text."""


_Dumper.add_representer(
    str,
    lambda _, text: yaml.ScalarNode("tag:yaml.org,2002:str", text, style=None if written(text) == text else '"'),
)


def _sections(value: Value, above: str) -> Iterator[tuple[str, Value]]:
    """Yield the parameters in a mapping of names with the name of each section, in the order of the file."""
    for key, member in value.members.items():
        if key == _SECTION:
            if not above:
                _refuse(f"{_SECTION}: has no node above it", "write the node's name above it, or /** for all", member)
            if member.content is not None and not isinstance(member.content, dict):
                _refuse(f"{_SECTION}: must be a mapping", "write `name: value` lines below it", member)
            yield above, nested(member)
            continue
        inner = key if above else key.removeprefix("/")
        name = f"{above}/{inner}" if inner else above  # the root namespace is `/`
        for part in inner.split("/") if inner else ():
            fault = node_name_fault(part)
            if fault is not None and part not in _WILDCARDS:
                fix = f"a name has parts of letters, digits and _; {_MEANING}"
                _refuse(f"{key} is not the name of a node: {fault.message}", fix, member)
        if not member.members:
            _refuse(f"{_SECTION}: is missing below {key}", f"write the parameters below {_SECTION}:", member)
        yield from _sections(member, name)


def _matches(section: str, node: str) -> bool:
    """Return whether a section's name, which may have wildcards, is that of a node.

    >>> [_matches(name, "/left/arm/hand") for name in ("/**", "/**/hand", "/left/*/hand", "/*/hand", "/left/**")]
    [True, True, True, False, True]
    """
    parts = node.split("/")[1:]
    reached = {0}  # the numbers of parts that the section may have matched so far
    for each in section.split("/")[1:]:
        if each == "**":
            reached = set(range(min(reached), len(parts) + 1))
        else:
            reached = {at + 1 for at in reached if at < len(parts) and each in ("*", parts[at])}
        if not reached:
            return False
    return len(parts) in reached


def nested(value: Value, depth: int = 0, *, whole: bool = True) -> Value:
    """Return parameters with a level of nesting for each dot of a name: `noise.imu` is `imu` below `noise`.

    Args:
        value: A mapping of parameters.
        depth: How deep it is nested itself.
        whole: Also in the mappings in it, which may be values of parameters.

    Raises:
        LaunchError: They are nested too deep.
    """
    members: dict[str, Value] = {}
    for key, member in value.members.items():
        names = key.split(".")
        first, *steps = names if all(map(str.isidentifier, names)) else [key]
        below = depth + 1 + len(steps)
        if below > MAX_DEPTH:
            _refuse(f"a parameter is nested deeper than {MAX_DEPTH} levels", "give it a shorter name", member)
        inner = nested(member, below) if whole and isinstance(member.content, dict) else member
        for step in reversed(steps):
            inner = Value({step: inner}, member.origin, member.key)
        members[first] = members[first].merged(inner) if first in members else inner
    return replace(value, content=members)


def _refuse(message: str, fix: str, value: Value) -> NoReturn:
    raise LaunchError([problem_at("bad-section", message, fix, key_origin(value))])
