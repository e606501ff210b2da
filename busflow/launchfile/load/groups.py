"""Flattens groups: makes their nodes, topics and includes entries of the file, with their namespaces and defaults."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from busflow.launchfile.load.merge import changed, compose, duplicate, full_key, is_off, names_plugin
from busflow.launchfile.model.keys import GraphKeys, IncludeKeys, LaunchKeys
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.yaml.value import Value


@dataclass(frozen=True, slots=True)
class Included:
    """A file to include, with the namespace of its group."""

    keys: IncludeKeys
    entry: Value
    namespace: str | None


def flattened(keys: LaunchKeys, tree: Value, problems: Problems) -> tuple[Value, list[Included]]:
    """Return a file without groups and defaults, and its includes. Namespaces are still relative to the file's."""
    flat = _Flat(problems)
    flat.add(keys, tree, None, Value({}, tree.origin), None)
    members = {key: value for key, value in tree.members.items() if key not in {"groups", "defaults"}}
    for section, entries in flat.entries.items():
        if entries or section in members:
            members[section] = replace(members.get(section, tree), content=entries)
    return replace(tree, content=members), flat.includes


@dataclass(slots=True)
class _Flat:
    """Entries of a file and of all its groups, in one level."""

    problems: Problems
    includes: list[Included] = field(default_factory=list[Included])
    entries: dict[str, dict[str, Value]] = field(default_factory=lambda: {"nodes": {}, "programs": {}, "topics": {}})

    def add(self, keys: GraphKeys, tree: Value, namespace: str | None, below: Value, off: Value | None) -> None:
        """Add the entries of a file or a group.

        Args:
            keys: The checked keys of the tree.
            tree: The file or the group.
            namespace: The group's namespace, relative to the file's; None for the file itself.
            below: The defaults of the enclosing file or group.
            off: The `when` of an enclosing group, if it is false.
        """
        defaults = tree.members.get("defaults")
        below = below.merged(defaults) if defaults is not None and defaults.content is not None else below
        for key, stated in tree.section("nodes").items():
            node = below.merged(stated) if names_plugin(stated) else stated
            if namespace is None:
                self._put("nodes", key, node, off)
            else:
                node = _with_dependencies(node, namespace)
                self._put("nodes", full_key(key, node, namespace), node.without(("namespace",)), off)
        for key, program in tree.section("programs").items():
            if namespace is None:
                self._put("programs", key, program, off)
            else:
                self._put("programs", compose(namespace, key), _with_dependencies(program, namespace), off)
        for key, topic in tree.section("topics").items():
            self._put("topics", compose(namespace, key) if namespace is not None else key, topic, off)
        for index, include in enumerate(keys.include):
            entry = tree.find(("include", index)) or tree.members["include"]
            if include.when and off is None:
                inner = include.namespace if namespace is None else compose(namespace, include.namespace)
                self.includes.append(Included(include, entry, inner or None))
        for name, group in keys.groups.items():
            inner = group.namespace if namespace is None else compose(namespace, group.namespace)
            value = tree.section("groups")[name]
            when = off or (None if group.when else value.members["when"])
            self.add(group, value, inner or "", below, when)

    def _put(self, section: str, key: str, value: Value, off: Value | None) -> None:
        entries = self.entries[section]
        value = value.with_member(("when",), off) if off is not None else value
        first = entries.get(key)
        if first is not None and section == "nodes" and names_plugin(first) != names_plugin(value):
            entries[key] = changed(value, first) if names_plugin(value) else changed(first, value)
        elif first is not None and not is_off(first) and not is_off(value):
            self.problems.add(duplicate(key, value, first, section.removesuffix("s")))
        elif first is None or is_off(first):
            entries[key] = value


def _with_dependencies(node: Value, namespace: str) -> Value:
    """Return a node or program with the names in its `depends_on` put into the group's namespace."""
    needs = node.members.get("depends_on")
    if needs is None or not isinstance(needs.content, dict):
        return node
    names = {compose(namespace, key): value for key, value in needs.content.items()}
    return node.with_member(("depends_on",), replace(needs, content=names))
