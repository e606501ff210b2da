"""Expands a launch file: repeats each entry as its `for_each` says, and replaces its expressions.

An entry whose `when` is false stays, so that another file can turn it on and its typing errors are reported. But the
names in its expressions need not exist.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

from busflow.errors import KeyPath, LaunchError
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.merge import changed, compose, duplicate, is_off, names_plugin
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.key_faults import without
from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.yaml.document import MAX_VALUES, Limits
from busflow.launchfile.yaml.value import Value

SECTIONS = ("nodes", "programs", "topics", "include", "groups")
"""Keys whose entries may have `for_each` and `when`."""


def expanded(file: Value, scope: Scope, problems: Problems, limits: Limits) -> Value:
    """Return a file with all entries expanded, without the values whose expressions failed.

    Its arguments stay unchanged. In its profiles, which may be for another place, failed expressions are no problem.
    """
    tree, failed = _Expander(scope, problems, limits).expand(file.without(("args",)).without(("profiles",)))
    problems.left_out |= failed
    tree = without(tree, failed)
    if "profiles" in file.members:
        tree = tree.with_member(("profiles",), readable(file.members["profiles"], scope, limits))
    return tree.with_member(("args",), file.members["args"]) if "args" in file.members else tree


def readable(profiles: Value, scope: Scope, limits: Limits) -> Value:
    """Return profiles that were not chosen, expanded so that they can be checked, without failed expressions."""
    members: dict[str, Value] = {}
    for name, profile in profiles.members.items():
        try:
            value, failed = _Expander(scope, Problems(), limits).expand(profile)
        except LaunchError:
            continue
        members[name] = value.without_any(failed)
    return replace(profiles, content=members) if isinstance(profiles.content, dict) else profiles


@dataclass(frozen=True, slots=True)
class _Made:
    """Expanded entry under its final key."""

    key: str
    value: Value
    failed: frozenset[KeyPath]
    """Paths in it whose expressions failed."""


@dataclass(slots=True)
class _Expander:
    """Expands the entries of a file and collects the problems."""

    scope: Scope
    problems: Problems
    limits: Limits

    def expand(self, graph: Value) -> tuple[Value, set[KeyPath]]:
        """Return a file with all entries expanded, and the paths in it whose expressions failed."""
        resolver = Resolver(self.scope, self.problems)
        if not isinstance(graph.content, dict):
            return resolver.resolve(graph), resolver.failed
        members: dict[str, Value] = {}
        for key, value in graph.members.items():
            if key in SECTIONS and isinstance(value.content, (dict, list)):
                members[key] = self._section(key, value, resolver.failed)
            else:
                members[key] = resolver.resolve(value, (key,))
        return replace(graph, content=members), resolver.failed

    def _section(self, section: str, value: Value, failed: set[KeyPath]) -> Value:
        if isinstance(value.content, list):
            items = [made for entry in value.content for made in self._entries(section, "", entry)]
            failed |= {(section, index, *path) for index, made in enumerate(items) for path in made.failed}
            return replace(value, content=[made.value for made in items])
        kept: dict[str, _Made] = {}
        for key, entry in value.members.items():
            for made in self._entries(section, key, entry):
                first = kept.get(made.key)
                if first is not None and section == "groups":  # names of groups are only labels
                    kept[f"{made.key} ({len(kept)})"] = made
                elif first is not None and section == "nodes" and not names_plugin(made.value):
                    kept[made.key] = replace(
                        first, value=changed(first.value, made.value), failed=first.failed | made.failed
                    )
                elif first is None or self._gives_way(section, first, made):
                    kept[made.key] = made
        failed |= {(section, key, *path) for key, made in kept.items() for path in made.failed}
        return replace(value, content={key: made.value for key, made in kept.items()})

    def _entries(self, section: str, key: str, entry: Value) -> Iterator[_Made]:
        """Yield an entry for each combination of its `for_each` items."""
        stated = entry.members.get("for_each")
        if stated is None:
            yield from self._made(section, key, entry, self.scope)
            return
        resolver = Resolver(self.scope, self.problems)
        variables = resolver.resolve(stated)
        if resolver.failed:
            self.problems.left_out.add(())
            return
        lists = {name: each.content for name, each in variables.members.items() if isinstance(each.content, list)}
        if not lists or len(lists) < len(variables.members):
            # The wrong for_each is reported with the other keys; uses of `each` are no further mistakes.
            scope = replace(self.scope, each={**self.scope.each, **variables.members})
            yield from self._made(section, key, entry.with_member(("for_each",), variables), scope)
            return
        body, size = entry.without(("for_each",)), sum(1 for _ in entry.leaves())
        for values in product(*lists.values()):
            self.limits.values -= size
            if self.limits.values < 0:
                message = f"a launch has at most {MAX_VALUES} values, and this makes more"
                self.problems.add(problem_at("too-many-values", message, "make its lists shorter", key_origin(stated)))
                raise LaunchError([])
            each = {**self.scope.each, **dict(zip(lists, values, strict=True))}
            yield from self._made(section, key, body, replace(self.scope, each=each))

    def _made(self, section: str, key: str, entry: Value, scope: Scope) -> Iterator[_Made]:
        """Yield the entry with its expressions replaced; nothing if its `when` is false and an expression failed."""
        when = entry.members.get("when")
        is_off = when is not None and Resolver(scope, self.problems).resolve(when).content is False
        problems = Problems() if is_off else self.problems
        try:
            name, value, failed = self._resolved(section, key, entry, scope, problems)
        except LaunchError:
            if not is_off:
                raise
            return
        if is_off and failed:
            return
        space = value.members.get("namespace")
        is_from_for_each = section == "nodes" and scope is not self.scope and ("namespace",) not in failed
        if is_from_for_each and space is not None and isinstance(space.content, str):
            name, value = compose(space.content, name), value.without(("namespace",))
        yield _Made(name, value, failed)

    def _resolved(
        self, section: str, key: str, entry: Value, scope: Scope, problems: Problems
    ) -> tuple[str, Value, frozenset[KeyPath]]:
        """Return the key and the content of an entry, and the paths whose expressions failed."""
        if section == "groups":
            value, failed = _Expander(scope, problems, self.limits).expand(entry)
            return key, value, frozenset(failed)
        resolver = Resolver(scope, problems)
        ((name, value),) = resolver.resolve(Value({key: entry}, entry.origin)).members.items()
        return name, value, frozenset(path[1:] for path in resolver.failed)

    def _gives_way(self, section: str, first: _Made, second: _Made) -> bool:
        """Return whether the first of two entries of one name is off and gives way; report two that are both on."""
        if is_off(first.value) or is_off(second.value):
            return is_off(first.value)
        problem = duplicate(second.key, second.value, first.value, section.removesuffix("s"))
        if first.value.key == second.value.key:
            message = f"for_each makes two {section} called {second.key}"
            problem = replace(problem, message=message, fix="let the key or `namespace` hold every variable: ${each.…}")
        self.problems.add(problem)
        return False
