"""`Part`: the contribution of one launch file to a graph, under final names; and the merging of several parts."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from busflow.errors import Place, Problem
from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.yaml.value import StatedPath, Value
from busflow.validation.faults import dotted


@dataclass(slots=True)
class Part:
    """Nodes, topics and settings of a file and its includes."""

    tree: Value
    """Keys of a launch file, without expressions, includes and arguments; nodes by `namespace/name`."""
    folders: list[StatedPath] = field(default_factory=list[StatedPath])
    warnings: list[Problem] = field(default_factory=list[Problem])
    own_folders: dict[str, tuple[Path, ...]] = field(default_factory=dict[str, tuple[Path, ...]])
    """By node, the plugin folders of the file that names its plugin."""
    interfaces: list[StatedPath] = field(default_factory=list[StatedPath])

    @property
    def nodes(self) -> Value:
        """Node entries."""
        return self.tree.members.get("nodes") or Value({}, self.tree.origin)


def compose(namespace: str, inner: str | None) -> str:
    """Join a namespace and an inner one; an absolute inner one replaces the outer.

    >>> compose("/left", "arm"), compose("/left", "/arm"), compose("/", "arm"), compose("/left", None)
    ('/left/arm', '/arm', '/arm', '/left')
    """
    if not inner or not namespace:
        return inner or namespace
    return inner if inner.startswith("/") else f"{namespace.rstrip('/')}/{inner}"


def full_key(key: str, node: Value, namespace: str) -> str:
    """Return a node's key with the namespaces of its entry and of its file."""
    stated = node.members.get("namespace")
    inner = stated.content if stated is not None and isinstance(stated.content, str) else None
    space, slash, name = key.rpartition("/")
    whole = compose(compose(namespace, inner), space or slash)
    return f"{whole.rstrip('/')}/{name}" if whole else name


def names_plugin(node: Value) -> bool:
    """Return whether an entry defines a node; without a plugin it changes one."""
    plugin = node.members.get("plugin")
    return plugin is not None and plugin.content is not None


def is_off(entry: Value) -> bool:
    """Return whether an entry is left out by its `when`."""
    when = entry.members.get("when")
    return when is not None and when.content is False


def changed(node: Value, change: Value) -> Value:
    """Return a node changed by an entry that names no plugin."""
    return replace(node.merged(change), key=node.key, origin=node.origin)


def named(part: Part, namespace: str, problems: Problems) -> Part:
    """Give the nodes, programs and topics in the part of one file their final names."""
    members = dict(part.tree.members)
    if "topics" in members:
        members["topics"] = _with_final_names(members["topics"], namespace, problems)
    if (expected := part.tree.find(("expect", "topics"))) is not None:
        topics = _with_final_names(expected, namespace, problems)
        members["expect"] = members["expect"].with_member(("topics",), topics)
    if "nodes" in members:
        names = {
            key: full_key(key, value, namespace).removeprefix("/") for key, value in members["nodes"].members.items()
        }
        nodes = _renamed(members["nodes"], names, problems, "node")
        inner = {key: value.without(("namespace",)) for key, value in nodes.members.items()}
        inner = {key: _with_final_dependencies(value, namespace, problems) for key, value in inner.items()}
        members["nodes"] = replace(nodes, content=inner)
        own = tuple(folder.path for folder in part.folders)
        part.own_folders = {key: own for key, value in inner.items() if "plugin" in value.members}
    if "programs" in members:
        names = {key: compose(namespace, key).removeprefix("/") for key in members["programs"].members}
        programs = _renamed(members["programs"], names, problems, "program")
        inner = {key: _with_final_dependencies(value, namespace, problems) for key, value in programs.members.items()}
        members["programs"] = replace(programs, content=inner)
    part.tree = replace(part.tree, content=members)
    return part


def joined(first: Part, second: Part, own: Part, problems: Problems) -> Part:
    """Merge two files that one file includes; report differences that the including file does not decide."""
    twice = {
        key: (node, first.nodes.members[key])
        for key, node in second.nodes.members.items()
        if key in first.nodes.members
    }
    problems.add(*_brought_twice(twice, len(own.tree.origin.included_from) + 1))
    for path, value in second.tree.leaves() if not twice else ():  # the fix for these may remove other conflicts too
        other = first.tree.find(path)
        is_open = path[:1] != ("nodes",) and own.tree.find(path) is None
        if is_open and other is not None and other.data != value.data:
            message = f"two included files disagree on {dotted(path)}; the other one is {other.origin}"
            fix = "state it in the file that includes both"
            problems.add(problem_at("include-conflict", message, fix, value.origin))
    return _laid(first, second)


def _brought_twice(nodes: Mapping[str, tuple[Value, Value]], depth: int) -> Iterator[Problem]:
    """Report nodes that two includes of a file both define, once for both includes, at the later one."""
    found: dict[tuple[tuple[Place, ...], Place], list[str]] = {}
    for name, (second, first) in nodes.items():
        here, there = second.origin.included_from[-depth:], first.origin.included_from[-depth:]
        if here and there:
            found.setdefault((here, there[0]), []).append(name)
    for (here, there), names in found.items():
        place = here[0]
        file = place.excerpt[place.column - 1 :][: place.width]
        which = f"{names[0]} and {len(names) - 1} more" if len(names) > 1 else names[0]
        message = f"two includes bring the node {which}; the first is {there}"
        fix = f"give one of the includes a namespace: {{file: {file}, namespace: left}}"
        if there == place:  # a for_each
            message, fix = (
                f"this include brings the node {which} several times",
                "namespace: ${each.…} keeps them apart",
            )
        yield Problem("duplicate-node", message, fix, place, included_from=here[1:])


def overlaid(included: Part, own: Part, problems: Problems) -> Part:
    """Merge a file over its includes. A node without a plugin changes one of an included file."""
    nodes = dict(own.nodes.members)
    for key, node in own.nodes.members.items():
        below = included.nodes.members.get(key)
        if below is not None and names_plugin(node):
            fix = "rename one of them; to change the included node, leave `plugin:` out"
            problems.add(replace(duplicate(key, node, below), fix=fix))
        if below is None and not names_plugin(node):
            message = f"the node {key} names no plugin"
            fix = f"add `plugin: {key.rpartition('/')[2]}`"
            problems.add(problem_at("missing-plugin", message, fix, key_origin(node)))
            del nodes[key]
    tree = replace(own.tree, content={**own.tree.members, "nodes": replace(own.nodes, content=nodes)})
    return _laid(included, replace(own, tree=tree))


def _laid(below: Part, above: Part) -> Part:
    return Part(
        below.tree.merged(above.tree),
        [*above.folders, *below.folders],
        [*below.warnings, *above.warnings],
        {**below.own_folders, **above.own_folders},
        [*above.interfaces, *below.interfaces],
    )


def _with_final_names(topics: Value, namespace: str, problems: Problems) -> Value:
    return _renamed(topics, {key: compose(namespace, key) for key in topics.members}, problems, "topic")


def _with_final_dependencies(node: Value, namespace: str, problems: Problems) -> Value:
    """Return a node or program with final names in its `depends_on`, which are written like the keys of nodes."""
    needs = node.members.get("depends_on")
    if needs is None or not isinstance(needs.content, dict):
        return node
    names = {key: compose(namespace, key).removeprefix("/") for key in needs.members}
    return node.with_member(("depends_on",), _renamed(needs, names, problems, "dependency"))


def _renamed(section: Value, names: dict[str, str], problems: Problems, noun: str) -> Value:
    """Return a section under final names; report two keys with the same name."""
    members: dict[str, Value] = {}
    for key, value in section.members.items():
        name = names[key]
        if name in members:
            problems.add(duplicate(name, value, members[name], noun))
        members.setdefault(name, value)
    return replace(section, content=members)


def duplicate(name: str, second: Value, first: Value, noun: str = "node") -> Problem:
    """Return the problem of two entries with the same name."""
    message = f"two entries are the {noun} {name}; the first is {key_origin(first)}"
    return problem_at(f"duplicate-{noun}", message, "rename one of them", key_origin(second))
