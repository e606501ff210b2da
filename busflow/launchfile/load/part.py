"""Turns a launch file and its includes into a `Part` of a graph: each step takes the result of the one before."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from pathlib import Path

from busflow.errors import LaunchError, Problem
from busflow.launchfile.load.arguments import bind
from busflow.launchfile.load.build_network import anchored
from busflow.launchfile.load.build_programs import in_folder, variables
from busflow.launchfile.load.expand import expanded
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.files import Files
from busflow.launchfile.load.groups import Included, flattened
from busflow.launchfile.load.merge import Part, compose, full_key, joined, named, overlaid
from busflow.launchfile.load.override import SETTABLE
from busflow.launchfile.load.parameter_file import nested
from busflow.launchfile.load.profiles import chosen
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.key_faults import checked
from busflow.launchfile.model.problems import Problems, key_origin, problem_at, warning_at
from busflow.launchfile.yaml.value import Value

MAX_INCLUDE_DEPTH = 16


@dataclass(frozen=True, slots=True)
class LaunchFile:
    """File to read, with the settings from outside of it."""

    path: Path
    profiles: Sequence[Value] = ()
    """Requested profiles."""
    given: Mapping[str, Value] = field(default_factory=dict[str, Value])
    """Values of its arguments."""
    entry: Value | None = None
    """Value that names it in the including file."""
    namespace: str = "/"
    chain: tuple[Path, ...] = ()
    """Including files, from the launched one on."""
    env: Mapping[str, str] = field(default_factory=dict[str, str])
    """Environment variables that these files state."""


def part_of(file: LaunchFile, files: Files, outside: Scope) -> Part | None:
    """Return the part of a file with its includes; None if it cannot be read."""
    problems, folder = files.problems, file.path.parent
    root = files.launch_file(file.path, file.entry)
    if root is None:
        return None
    outside = replace(outside, used=set[str]())
    around = replace(outside, env={**outside.env, **file.env})
    root = chosen(root, file.profiles, around, problems)
    bound = bind(root.members.get("args"), file.given, Resolver(around, problems))
    scope = replace(around, args=bound.values, broken=frozenset(bound.broken))
    stated = variables(Resolver(scope, Problems()).resolve(root.members.get("env", root.without(()))))
    file = replace(file, env={**stated, **file.env}, chain=(*file.chain, file.path.resolve()))
    scope = replace(scope, env={**scope.env, **file.env})
    tree = expanded(root, scope, problems, files.limits)
    keys, tree = checked(anchored(tree, folder), problems)
    file = replace(file, namespace=compose(file.namespace, keys.namespace))
    tree = _with_parameter_files(tree, file.namespace, folder, scope, files)
    tree, includes = flattened(keys, tree, problems)
    tree = in_folder(tree, folder)
    folders, interfaces = (files.folders(tree, key, folder) for key in ("plugins", "interfaces"))
    kept = {key: value for key, value in tree.members.items() if key in {*SETTABLE, "env"}}
    own = Part(replace(tree, content=kept), folders, interfaces=interfaces)
    own = named(own, file.namespace, problems)
    included = Part(Value({}, tree.origin))
    for include in includes:
        inner = _inner(include, file, problems)
        part = part_of(inner, files, outside) if inner is not None else None
        included = joined(included, part, own, problems) if part is not None else included
    whole = overlaid(included, own, problems)
    whole.warnings = [*_unused_arguments(root, scope), *included.warnings]
    return whole


def _inner(include: Included, file: LaunchFile, problems: Problems) -> LaunchFile | None:
    """Return a file that another one includes; None for an include cycle or too deep nesting."""
    entry, chain = include.entry, file.chain
    stated = entry.members.get("file", entry)
    target = Path(os.path.normpath(file.path.parent / include.keys.file))
    real = target.resolve()
    if real in chain:
        loop = [*chain[chain.index(real) :], real]
        message = f"{include.keys.file} includes itself: {' → '.join(each.name for each in loop)}"
        problems.add(problem_at("include-cycle", message, "leave one of these includes out", stated.origin))
        return None
    if len(chain) > MAX_INCLUDE_DEPTH:
        message = f"includes nest deeper than {MAX_INCLUDE_DEPTH} files"
        problems.add(problem_at("too-many-files", message, "include the files side by side", stated.origin))
        return None
    profiles = [entry.members["profile"]] if include.keys.profile is not None else []
    namespace = compose(file.namespace, include.namespace)
    return LaunchFile(target, profiles, entry.section("args"), stated, namespace, chain, file.env)


def _with_parameter_files(graph: Value, namespace: str, folder: Path, scope: Scope, files: Files) -> Value:
    """Return a file or group with the content of each node's `parameters_from` merged under its `parameters`.

    Dotted names among these, and in its `defaults`, become nested mappings.

    Args:
        graph: The file or group.
        namespace: Its full namespace.
        folder: The folder that the files are relative to.
        scope: The meaning of their expressions.
        files: Reads them.
    """
    if (shared := graph.find(("defaults", "parameters"))) is not None:
        graph = graph.with_member(("defaults", "parameters"), _without_dots(shared, files.problems))
    for key, node in graph.section("nodes").items():
        if "parameters_from" in node.members or any("." in name for name in node.section("parameters")):
            name = full_key(key, node, namespace)
            graph = graph.with_member(("nodes", key), _completed(node, name, folder, scope, files))
    for name, group in graph.section("groups").items():
        stated = group.members.get("namespace")
        inner = compose(namespace, str(stated.content) if stated is not None and stated.content is not None else None)
        graph = graph.with_member(("groups", name), _with_parameter_files(group, inner, folder, scope, files))
    return graph


def _without_dots(parameters: Value, problems: Problems) -> Value:
    """Return parameters with dotted names as nested mappings; report those that are too deep, and leave them out."""
    try:
        return nested(parameters, whole=False) if isinstance(parameters.content, dict) else parameters
    except LaunchError as error:
        problems.add(*error.problems)
        return parameters.without_any((name,) for name in parameters.members if "." in name)


def _completed(node: Value, name: str, folder: Path, scope: Scope, files: Files) -> Value:
    stated, own = node.members.get("parameters_from"), node.members.get("parameters")
    layers: list[Value] = []
    for value in () if stated is None else stated.content if isinstance(stated.content, list) else [stated]:
        found = files.parameters(Path(os.path.normpath(folder / str(value.content))), value, name, scope)
        if found is not None:
            layers.append(found)
    if own is not None and own.content is not None:
        layers.append(own)
    layers = [_without_dots(each, files.problems) for each in layers]
    merged = reduce(Value.merged, layers) if layers else Value({}, node.origin)
    return node.without(("parameters_from",)).with_member(("parameters",), merged)


def _unused_arguments(root: Value, scope: Scope) -> Iterator[Problem]:
    """Yield a warning for each argument that no expression uses: its value changes nothing."""
    for name, entry in root.section("args").items():
        if name not in scope.used:
            message, fix = f"nothing uses the argument {name}", f"write ${{args.{name}}} where it is meant"
            yield warning_at("unused-argument", message, fix, key_origin(entry))
