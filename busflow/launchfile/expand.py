"""Expansion: each entry of a launch file as often as its `for_each` says, with its expressions replaced.

An entry whose `when` is false stays, so that another file may turn it on and its typing errors are told; but what its
expressions need need not be there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import product

from busflow.errors import KeyPath, LaunchError
from busflow.launchfile.document import MAX_VALUES, Limits
from busflow.launchfile.expression import Scope
from busflow.launchfile.faults import key_origin, problem_at
from busflow.launchfile.merge import compose
from busflow.launchfile.problems import Problems
from busflow.launchfile.resolver import Resolver
from busflow.launchfile.value import Value

SECTIONS = ("nodes", "topics", "include")
"""The keys below which entries stand that may have `for_each` and `when`."""


@dataclass(frozen=True, slots=True)
class _Made:
    """An entry in which every expression is replaced, under its final key."""

    key: str
    value: Value
    failed: frozenset[KeyPath]
    """The paths in it whose expression could not be evaluated."""

    @property
    def is_off(self) -> bool:
        """Whether its `when` is false."""
        when = self.value.members.get("when")
        return when is not None and when.content is False


@dataclass(slots=True)
class Expander:
    """Replaces the expressions of a file, collecting what is wrong."""

    scope: Scope
    problems: Problems
    limits: Limits

    def expand(self, graph: Value) -> tuple[Value, set[KeyPath]]:
        """A file with its entries as often as they shall be there, and the paths in it that could not be evaluated."""
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
                if made.key not in kept or self._gives_way(section, kept[made.key], made):
                    kept[made.key] = made
        failed |= {(section, key, *path) for key, made in kept.items() for path in made.failed}
        return replace(value, content={key: made.value for key, made in kept.items()})

    def _entries(self, section: str, key: str, entry: Value) -> Iterator[_Made]:
        """An entry as often as it is to be there."""
        stated = entry.members.get("for_each")
        if stated is None:
            yield from self._made(section, key, entry, self.scope)
            return
        resolver = Resolver(self.scope, self.problems)
        variables = resolver.resolve(stated)
        if resolver.failed:
            return
        lists = {name: each.content for name, each in variables.members.items() if isinstance(each.content, list)}
        if not lists or len(lists) < len(variables.members):
            # What is wrong with it is told with the other keys, and `each` is not to blame.
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
        """The entry with its expressions replaced; none if it is off and they cannot be."""
        when = entry.members.get("when")
        is_off = when is not None and Resolver(scope, self.problems).resolve(when).content is False
        resolver = Resolver(scope, Problems() if is_off else self.problems)
        try:
            named = resolver.resolve(Value({key: entry}, entry.origin))
        except LaunchError:
            if not is_off:
                raise
            return
        if is_off and resolver.failed:
            return
        ((name, value),) = named.members.items()
        failed = frozenset(path[1:] for path in resolver.failed)
        space = value.members.get("namespace")
        is_told_apart = section == "nodes" and scope is not self.scope and ("namespace",) not in failed
        if is_told_apart and space is not None and isinstance(space.content, str):
            name, value = compose(space.content, name), value.without(("namespace",))
        yield _Made(name, value, failed)

    def _gives_way(self, section: str, first: _Made, second: _Made) -> bool:
        """Whether the first of two entries of one name gives way to the second, being left out itself."""
        if first.is_off or second.is_off:
            return first.is_off
        noun, origin = section.removesuffix("s"), key_origin(second.value)
        if first.value.key == second.value.key:
            message = f"for_each makes two {section} called {second.key}"
            fix = "let the key or `namespace` hold every variable: ${each.…}"
        else:
            message = f"two entries are the {noun} {second.key}; the first is {key_origin(first.value)}"
            fix = "rename one of them"
        self.problems.add(problem_at(f"duplicate-{noun}", message, fix, origin))
        return False
