"""Loading a launch file: its includes, arguments and overrides, merged into one `LaunchDescription`.

What is stated later wins: a plugin's default < an included file < the file < the command line. Every problem is
collected; what is wrong is left out, and the rest is looked at all the same.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import reduce
from itertools import islice
from pathlib import Path

from busflow.errors import Fault, KeyPath, LaunchError, Place, Problem, Severity
from busflow.launchfile import arguments, override
from busflow.launchfile.build import Builder
from busflow.launchfile.description import Argument, LaunchDescription, PluginFolder
from busflow.launchfile.document import Limits, read_file
from busflow.launchfile.expand import Expander
from busflow.launchfile.expression import Budget, Scope
from busflow.launchfile.faults import key_origin, problem_at, problems
from busflow.launchfile.merge import Part, compose, joined, named, overlaid
from busflow.launchfile.model import IncludeKeys, LaunchKeys, key_faults
from busflow.launchfile.problems import Problems
from busflow.launchfile.resolver import Resolver
from busflow.launchfile.value import Origin, Source, Value
from busflow.text import nearest
from busflow.validation import MOST_FAULTS

MAX_FILES = 100
MAX_INCLUDE_DEPTH = 16


def load(
    path: str | Path,
    *,
    args: Mapping[str, object] | None = None,
    overrides: Mapping[str, object] | None = None,
    assignments: Sequence[str] = (),
    sets: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
) -> LaunchDescription:
    """What a launch file describes.

    Args:
        path: The file.
        args: Values of its arguments, from Python.
        overrides: Values of the description by dotted path, from Python.
        assignments: `name:=value` of a command line.
        sets: `path=value` of a command line's `--set`.
        environment: What `${env.…}` stands for; by default the process's own.

    Raises:
        LaunchError: With every problem.
    """
    description, found = examine(
        path, args=args, overrides=overrides, assignments=assignments, sets=sets, environment=environment
    )
    if found or description is None:
        raise LaunchError(found)
    return description


def examine(
    path: str | Path,
    *,
    args: Mapping[str, object] | None = None,
    overrides: Mapping[str, object] | None = None,
    assignments: Sequence[str] = (),
    sets: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
) -> tuple[LaunchDescription | None, tuple[Problem, ...]]:
    """As `load`, for a report: every problem, and the description of what is right beside them."""
    loader = _Loader(environment if environment is not None else os.environ)
    given = arguments.from_caller(args or {})
    changes = override.from_caller(overrides or {})
    for text in assignments:
        with loader.problems.collecting():
            name, value = override.parse_assignment(text)
            given[name] = value
    for text in sets:
        with loader.problems.collecting():
            changes.append(override.parse_override(text))
    description: LaunchDescription | None = None
    with loader.problems.collecting():
        description = loader.description(Path(path), given, changes)
    return description, loader.problems.sorted(map(str, loader.files))


def read_arguments(path: str | Path, environment: Mapping[str, str] | None = None) -> tuple[Argument, ...]:
    """The arguments that a launch file declares, for its help; those without a default have no value.

    Raises:
        LaunchError: The file cannot be read.
    """
    root = read_file(Path(path), str(path))
    scope = Scope(environment if environment is not None else os.environ)
    problems = Problems()
    with problems.collecting():
        bound = arguments.bind(root.members.get("args"), {}, Resolver(scope, problems))
        return tuple(bound.known.values())
    return ()


class _Loader:
    """Reads files into parts, collecting what is wrong with them."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.problems = Problems()
        self.files: list[Path] = []
        self._scopes: list[tuple[Value, Scope]] = []
        self._environment = environment
        self._budget = Budget()
        self._limits = Limits()

    def description(
        self, path: Path, given: Mapping[str, Value], changes: Iterable[override.Override]
    ) -> LaunchDescription | None:
        """The description of a file under what the command line or a caller says."""
        root = self._read(path, None, ())
        if root is None:
            return None
        bound, resolver = self._arguments(root, given)
        part = self._part(path, root, resolver, "/", (path.resolve(),))
        for change in changes:
            part.tree, problem = override.apply(part.tree, change)
            if problem is not None:
                self.problems.add(problem)
        keys, part.tree = self._checked(part.tree)
        builder = Builder(part, keys, self.problems)
        description = builder.build(path.stem, bound.known, tuple(self.files))
        if not description.nodes and not self.problems:
            message, fix = "the file names no nodes: there is nothing to run", "add `nodes:`"
            if keys.nodes:
                message, fix = "every node is left out by its `when`: there is nothing to run", None
            self.problems.add(problem_at("no-nodes", message, fix, root.origin))
        return replace(description, warnings=tuple(self._unused_arguments()))

    def _unused_arguments(self) -> Iterator[Problem]:
        """Arguments that no expression names: whoever gives them a value waits in vain for what it does."""
        for root, scope in self._scopes:
            for name, entry in root.section("args").items():
                if name not in scope.used:
                    message, fix = f"nothing uses the argument {name}", f"write ${{args.{name}}} where it is meant"
                    problem = problem_at("unused-argument", message, fix, key_origin(entry))
                    yield replace(problem, severity=Severity.WARNING)

    def _read(self, path: Path, entry: Value | None, via: tuple[Place, ...]) -> Value | None:
        """A file's content. What keeps it from being read is told at the `entry` that names it."""
        if self._limits.values < 0:
            raise LaunchError([])  # a file before this one was too large, and that is told
        if len(self.files) >= MAX_FILES:
            self._tell("too-many-files", f"more than {MAX_FILES} files are read", "include less", entry)
            raise LaunchError([])
        self.files.append(path)
        try:
            return read_file(path, str(path), via, self._limits)
        except LaunchError as error:
            for problem in error.problems:
                if problem.code == "unreadable-file":
                    self._tell(problem.code, problem.message, _neighbour(path), entry)
                else:
                    self.problems.add(problem)
        return None

    def _arguments(self, root: Value, given: Mapping[str, Value]) -> tuple[arguments.Arguments, Resolver]:
        """A file's arguments, and what resolves the expressions of its other keys."""
        resolver = Resolver(Scope(self._environment, budget=self._budget), self.problems)
        bound = arguments.bind(root.members.get("args"), given, resolver)
        scope = Scope(self._environment, bound.values, frozenset(bound.broken), self._budget)
        self._scopes.append((root, scope))
        return bound, Resolver(scope, self.problems)

    def _part(self, path: Path, root: Value, resolver: Resolver, around: str, chain: tuple[Path, ...]) -> Part:
        """What a file and its includes add, under the namespace `around`."""
        declared = root.members.get("args")
        expander = Expander(resolver.scope, self.problems, self._limits)
        tree = _without(*expander.expand(root.without(("args",))))
        if declared is not None:
            tree = tree.with_member(("args",), declared)
        keys, tree = self._checked(tree)
        namespace = compose(around, keys.namespace)
        stated = {key: value for key, value in tree.members.items() if key in override.SETTABLE}
        own = Part(replace(tree, content=stated), self._folders(path, tree))
        own.tree = self._with_parameter_files(path, own.tree, resolver.scope)
        own = named(own, namespace, self.problems)
        included = Part(Value({}, tree.origin))
        for index, include in enumerate(keys.include):
            entry = tree.find(("include", index)) or tree.members["include"]
            if not include.when:
                continue
            part = self._included(path, include, entry, compose(namespace, include.namespace), chain)
            included = joined(included, part, own, self.problems) if part is not None else included
        return overlaid(included, own, self.problems)

    def _included(
        self, path: Path, include: IncludeKeys, entry: Value, namespace: str, chain: tuple[Path, ...]
    ) -> Part | None:
        stated = entry.members.get("file", entry)
        target = Path(os.path.normpath(path.parent / include.file))
        real = target.resolve()
        if real in chain:
            loop = [*chain[chain.index(real) :], real]
            names = " → ".join(each.name for each in loop)
            message, fix = f"{include.file} includes itself: {names}", "leave one of these includes out"
            self._tell("include-cycle", message, fix, stated)
            return None
        if len(chain) > MAX_INCLUDE_DEPTH:
            message = f"includes nest deeper than {MAX_INCLUDE_DEPTH} files"
            self._tell("too-many-files", message, "include the files side by side", stated)
            return None
        via = (stated.origin.place, *stated.origin.included_from) if stated.origin.place is not None else ()
        root = self._read(target, stated, via)
        if root is None:
            return None
        _, resolver = self._arguments(root, entry.section("args"))
        return self._part(target, root, resolver, namespace, (*chain, real))

    def _folders(self, path: Path, tree: Value) -> list[PluginFolder]:
        """A file's plugin folders, relative to the file."""
        found: list[PluginFolder] = []
        stated = tree.members.get("plugins")
        for value in stated.content if stated is not None and isinstance(stated.content, list) else []:
            folder = Path(os.path.normpath(path.parent / str(value.content)))
            if folder.is_dir():
                found.append(PluginFolder(folder, value.origin))
            else:
                self._tell("missing-folder", f"there is no folder {folder}", _neighbour(folder), value)
        return found

    def _with_parameter_files(self, path: Path, tree: Value, scope: Scope) -> Value:
        """Each node's `parameters_from`, laid under its `parameters`."""
        nodes = dict(tree.section("nodes"))
        for key, node in nodes.items():
            stated = node.members.get("parameters_from")
            if stated is None:
                continue
            layers: list[Value | None] = []
            for value in stated.content if isinstance(stated.content, list) else [stated]:
                target = Path(os.path.normpath(path.parent / str(value.content)))
                layers.append(self._parameters(target, value, scope))
            own = node.members.get("parameters")
            layers.append(own if own is not None and own.content is not None else None)
            present = [layer for layer in layers if layer is not None]
            merged = reduce(Value.merged, present) if present else Value({}, node.origin)
            nodes[key] = node.without(("parameters_from",)).with_member(("parameters",), merged)
        return (
            tree
            if not nodes
            else replace(tree, content={**tree.members, "nodes": replace(tree.members["nodes"], content=nodes)})
        )

    def _parameters(self, path: Path, entry: Value, scope: Scope) -> Value | None:
        """The parameters of a file that a node names."""
        via = (entry.origin.place, *entry.origin.included_from) if entry.origin.place is not None else ()
        found = self._read(path, entry, via)
        if found is None:
            return None
        if not isinstance(found.content, dict):
            message, fix = f"{path} must hold a mapping of parameters", "write `name: value` lines"
            self.problems.add(problem_at("wrong-type", message, fix, found.origin))
            return None
        resolver = Resolver(scope, self.problems)
        resolved = resolver.resolve(found)
        return _without(resolved, resolver.failed)

    def _checked(self, tree: Value) -> tuple[LaunchKeys, Value]:
        """The keys of a tree as a model, without those that are wrong: these are told."""
        first = True
        while True:
            keys, faults = key_faults(tree.data)
            if keys is not None:
                return keys, tree
            # What is missing only because it was wrong and left out is told already.
            told = [fault for fault in faults if first or fault.code != "missing"]
            first = False
            self.problems.add(*problems(_once(told, tree), tree, noun="key"))
            if len(faults) >= MOST_FAULTS:
                raise LaunchError([])  # the rest would only repeat what is told
            tree = _without(tree, (fault.path for fault in faults))

    def _tell(self, code: str, message: str, fix: str | None, entry: Value | None) -> None:
        """A problem at the value that names a file, or at no place for the launch file itself."""
        origin = entry.origin if entry is not None else Origin(Source.CALLER)
        self.problems.add(problem_at(code, message, fix, origin))


def _once(faults: Iterable[Fault], tree: Value) -> list[Fault]:
    """The faults without those of a further entry of the same `for_each`: the same key of the same line."""
    found: dict[object, Fault] = {}
    for fault in faults:
        place = tree.nearest(fault.path).key or tree.nearest(fault.path).origin.place
        found.setdefault((place, fault.code, fault.path[-1:]) if place is not None else fault, fault)
    return list(found.values())


def _without(tree: Value, paths: Iterable[KeyPath]) -> Value:
    """The tree without what is at these paths, or at the nearest parent of one that is not there."""
    # The last items of a list go first, so that the numbers of the others stay right.
    for path in sorted(paths, key=lambda path: [f"{step:0>9}" for step in path], reverse=True):
        whole = path[:2] if path[:1] == ("nodes",) and path[2:] == ("plugin",) else path
        stated = next(whole[:end] for end in range(len(whole), -1, -1) if tree.find(whole[:end]) is not None)
        tree = tree.without(stated)
    return tree


def _neighbour(path: Path) -> str | None:
    """The file or folder beside a missing one that was probably meant."""
    try:
        if path.exists():
            return None
        near = nearest(path.name, [each.name for each in islice(path.parent.iterdir(), 1000)])
    except (OSError, ValueError):
        return f"create the folder {path.parent}" if not path.parent.exists() else None
    return f"did you mean {near!r}?" if near else None
