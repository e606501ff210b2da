"""Groups: their nodes, topics and includes as entries of the file itself, with their namespaces and defaults put in."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from busflow.launchfile.load.merge import changed, compose, duplicate, full_key, is_off, names_plugin
from busflow.launchfile.model.keys import GraphKeys, IncludeKeys, LaunchKeys
from busflow.launchfile.model.problems import Problems
from busflow.launchfile.yaml.value import Value


@dataclass(frozen=True, slots=True)
class Included:
    """A file to include, and where."""

    keys: IncludeKeys
    entry: Value
    namespace: str | None


def flattened(keys: LaunchKeys, tree: Value, problems: Problems) -> tuple[Value, list[Included]]:
    """The tree of a file without groups and defaults, and what it includes; namespaces are still below the file's."""
    flat = _Flat(problems)
    flat.add(keys, tree, None, Value({}, tree.origin), None)
    members = {key: value for key, value in tree.members.items() if key not in {"groups", "defaults"}}
    for section, entries in flat.entries.items():
        if entries or section in members:
            members[section] = replace(members.get(section, tree), content=entries)
    return replace(tree, content=members), flat.includes


@dataclass(slots=True)
class _Flat:
    """The entries of a file and of its groups, side by side."""

    problems: Problems
    includes: list[Included] = field(default_factory=list[Included])
    entries: dict[str, dict[str, Value]] = field(default_factory=lambda: {"nodes": {}, "topics": {}})

    def add(self, keys: GraphKeys, tree: Value, namespace: str | None, below: Value, off: Value | None) -> None:
        """Add what stands in a file or a group.

        Args:
            keys: What the tree says, checked.
            tree: The file or the group.
            namespace: The one around, below that of the file; None for the file itself.
            below: The defaults of what is around.
            off: The `when` of a group around that is false.
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
    """A node that names those that it waits for as the keys of its group do."""
    needs = node.members.get("depends_on")
    if needs is None or not isinstance(needs.content, dict):
        return node
    names = {compose(namespace, key): value for key, value in needs.content.items()}
    return node.with_member(("depends_on",), replace(needs, content=names))
