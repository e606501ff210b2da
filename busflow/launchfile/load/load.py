"""Loading a launch file: its includes, arguments and overrides, merged into one `LaunchDescription`.

What is stated later wins: a plugin's default < an included file < the file < the command line. Every problem is
collected; what is wrong is left out, and the rest is looked at all the same.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial, reduce
from itertools import islice
from pathlib import Path

from busflow.errors import KeyPath, LaunchError, Place, Problem, Severity
from busflow.launchfile.load import arguments, override
from busflow.launchfile.load.build import Builder, unreadable, variables
from busflow.launchfile.load.build_network import anchored
from busflow.launchfile.load.expand import Expander
from busflow.launchfile.load.expression import Budget, Scope
from busflow.launchfile.load.groups import Flat, Included
from busflow.launchfile.load.merge import Part, compose, joined, named, overlaid
from busflow.launchfile.load.profiles import chosen, from_command_line, readable
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.description import Argument, Doubt, LaunchDescription, PluginFolder
from busflow.launchfile.model.key_faults import doubt_about, key_faults, mended, once, without
from busflow.launchfile.model.keys import LaunchKeys
from busflow.launchfile.model.misplaced import set_right
from busflow.launchfile.model.problems import Problems, key_origin, problem_at, problems
from busflow.launchfile.yaml.document import Doubled, Limits, read_file
from busflow.launchfile.yaml.value import Origin, Source, Value
from busflow.text import nearest
from busflow.validation.faults import MOST_FAULTS

MAX_FILES = 100
MAX_INCLUDE_DEPTH = 16


def load(
    path: str | Path,
    *,
    args: Mapping[str, object] | None = None,
    overrides: Mapping[str, object] | None = None,
    assignments: Sequence[str] = (),
    sets: Sequence[str] = (),
    profiles: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
) -> LaunchDescription:
    """What a launch file describes.

    Args:
        path: The file.
        args: Values of its arguments, from Python.
        overrides: Values of the description by dotted path, from Python.
        assignments: `name:=value` of a command line.
        sets: `path=value` of a command line's `--set`.
        profiles: The profiles of the file that are to hold, the last one on top.
        environment: What `${env.…}` stands for; by default the process's own.

    Raises:
        LaunchError: With every problem.
    """
    description, found = examine(
        path,
        args=args,
        overrides=overrides,
        assignments=assignments,
        sets=sets,
        profiles=profiles,
        environment=environment,
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
    profiles: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
) -> tuple[LaunchDescription | None, tuple[Problem, ...]]:
    """As `load`, for a report: every problem, and the description of what is right beside them."""
    loader = _Loader(environment if environment is not None else os.environ)
    given = arguments.from_caller(args or {})
    changes = override.from_caller(overrides or {})
    assigned: set[str] = set()
    for text in assignments:
        with loader.problems.collecting():
            name, value = override.parse_assignment(text)
            if name in assigned:
                message, fix = f"the argument {name} is given twice", "leave one of them out"
                loader.problems.add(problem_at("duplicate-argument", message, fix, key_origin(value)), doubt=None)
            given[name] = value
            assigned.add(name)
    for text in sets:
        with loader.problems.collecting():
            changes.append(override.parse_override(text))
    description: LaunchDescription | None = None
    with loader.problems.collecting():
        description = loader.description(Path(path), given, changes, from_command_line(profiles))
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


@dataclass(frozen=True, slots=True)
class _Around:
    """What is around a file."""

    namespace: str = "/"
    chain: tuple[Path, ...] = ()
    """The files that led here, this one last."""
    env: Mapping[str, str] = field(default_factory=dict[str, str])
    """Variables of the environment that these files state."""


class _Loader:
    """Reads files into parts, collecting what is wrong with them."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self.problems = Problems()
        self.files: list[Path] = []
        self._scopes: list[tuple[Value, Scope]] = []
        self._environment = environment
        self._budget = Budget()
        self._limits = Limits()
        self._parameter_files: dict[tuple[Path, tuple[Place, ...]], Value | None] = {}

    def description(
        self, path: Path, given: Mapping[str, Value], changes: Iterable[override.Override], asked: Sequence[Value] = ()
    ) -> LaunchDescription | None:
        """The description of a file under what the command line or a caller says."""
        root = self._launch_file(path, None, ())
        if root is None:
            return None
        root = chosen(root, asked, Scope(self._environment), self.problems)
        bound, scope = self._arguments(root, given, {})
        part = self._part(path, root, scope, _Around())
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
        return replace(description, warnings=tuple(self._unused_arguments()), doubts=frozenset(self.problems.doubts))

    def _unused_arguments(self) -> Iterator[Problem]:
        """Arguments that no expression names: whoever gives them a value waits in vain for what it does."""
        for root, scope in self._scopes if Doubt.NODES not in self.problems.doubts else ():
            for name, entry in root.section("args").items():
                if name not in scope.used:
                    message, fix = f"nothing uses the argument {name}", f"write ${{args.{name}}} where it is meant"
                    problem = problem_at("unused-argument", message, fix, key_origin(entry))
                    yield replace(problem, severity=Severity.WARNING)

    def _launch_file(self, path: Path, entry: Value | None, via: tuple[Place, ...]) -> Value | None:
        """A launch file's content, each key on the level where it can stand."""
        doubled: list[Place | None] = []  # the keys whose value is one of two

        def note(problem: Problem, first: Value) -> None:
            self.problems.add(problem, doubt=None)
            doubled.append(None if isinstance(first.content, dict) else first.key)

        root = self._read(path, entry, via, note)
        if root is None:
            return None
        root = set_right(root, self.problems)
        unsure = [path for path, each in root.leaves() if each.key in doubled]
        self._doubt(unsure)
        # Which plugin is meant is not known, and so nothing of what the node should have.
        return without(root, [path for path in unsure if path[-1:] == ("plugin",)])

    def _doubt(self, paths: Iterable[KeyPath]) -> None:
        """Note what is left open where what is at these paths is not known."""
        self.problems.doubts |= {doubt for doubt in map(doubt_about, paths) if doubt is not None}

    def _read(
        self, path: Path, entry: Value | None, via: tuple[Place, ...], doubled: Doubled | None = None
    ) -> Value | None:
        """A file's content. What keeps it from being read is told at the `entry` that names it."""
        if self._limits.values < 0:
            raise LaunchError([])  # a file before this one was too large, and that is told
        if len(self.files) >= MAX_FILES:
            self._tell("too-many-files", f"more than {MAX_FILES} files are read", "include less", entry)
            raise LaunchError([])
        self.files.append(path)
        try:
            return read_file(path, str(path), via, self._limits, doubled)
        except LaunchError as error:
            for problem in error.problems:
                if problem.code == "unreadable-file":
                    place = entry.origin.place if entry is not None else None
                    beside = Path(place.file).parent if place is not None else None
                    doubt = Doubt.NODES if doubled is not None else Doubt.PARAMETERS  # a launch file, or not
                    self._tell(problem.code, problem.message, _neighbour(path, beside), entry, doubt)
                else:
                    self.problems.add(problem)
        return None

    def _arguments(
        self, root: Value, given: Mapping[str, Value], env: Mapping[str, str]
    ) -> tuple[arguments.Arguments, Scope]:
        """A file's arguments, and what the names in its other keys stand for."""
        env = {**self._environment, **env}
        bound = arguments.bind(
            root.members.get("args"), given, Resolver(Scope(env, budget=self._budget), self.problems)
        )
        scope = Scope(env, bound.values, frozenset(bound.broken), self._budget)
        self._scopes.append((root, scope))
        return bound, scope

    def _part(self, path: Path, root: Value, scope: Scope, around: _Around) -> Part:
        """What a file and its includes add."""
        stated = variables(Resolver(scope, Problems()).resolve(root.members.get("env", root.without(()))))
        around = replace(around, env={**stated, **around.env}, chain=(*around.chain, path.resolve()))
        scope = replace(scope, env={**scope.env, **around.env})
        expander = Expander(scope, self.problems, self._limits)
        tree, failed = expander.expand(root.without(("args",)).without(("profiles",)))
        self._doubt(failed)
        tree = without(tree, failed)
        if "profiles" in root.members:
            tree = tree.with_member(("profiles",), readable(root.members["profiles"], scope, self._limits))
        if "args" in root.members:
            tree = tree.with_member(("args",), root.members["args"])
        keys, tree = self._checked(anchored(tree, path.parent))
        around = replace(around, namespace=compose(around.namespace, keys.namespace))
        flat = Flat(self.problems, partial(self._completed, path, scope=scope))
        tree = flat.of(keys, tree)
        kept = {key: value for key, value in tree.members.items() if key in {*override.SETTABLE, "env"}}
        own = named(Part(replace(tree, content=kept), self._folders(path, tree)), around.namespace, self.problems)
        included = Part(Value({}, tree.origin))
        for include in flat.includes:
            part = self._included(path, include, around)
            included = joined(included, part, own, self.problems) if part is not None else included
        return overlaid(included, own, self.problems)

    def _included(self, path: Path, include: Included, around: _Around) -> Part | None:
        entry, chain = include.entry, around.chain
        stated = entry.members.get("file", entry)
        target = Path(os.path.normpath(path.parent / include.keys.file))
        real = target.resolve()
        if real in chain:
            loop = [*chain[chain.index(real) :], real]
            names = " → ".join(each.name for each in loop)
            message, fix = f"{include.keys.file} includes itself: {names}", "leave one of these includes out"
            self._tell("include-cycle", message, fix, stated)
            return None
        if len(chain) > MAX_INCLUDE_DEPTH:
            message = f"includes nest deeper than {MAX_INCLUDE_DEPTH} files"
            self._tell("too-many-files", message, "include the files side by side", stated)
            return None
        via = (stated.origin.place, *stated.origin.included_from) if stated.origin.place is not None else ()
        root = self._launch_file(target, stated, via)
        if root is None:
            return None
        asked = [entry.members["profile"]] if include.keys.profile is not None else []
        root = chosen(root, asked, Scope({**self._environment, **around.env}), self.problems)
        _, scope = self._arguments(root, entry.section("args"), around.env)
        namespace = compose(around.namespace, include.namespace)
        return self._part(target, root, scope, replace(around, namespace=namespace))

    def _folders(self, path: Path, tree: Value) -> list[PluginFolder]:
        """A file's plugin folders, relative to the file."""
        found: list[PluginFolder] = []
        stated = tree.members.get("plugins")
        for value in stated.content if stated is not None and isinstance(stated.content, list) else []:
            folder = Path(os.path.normpath(path.parent / str(value.content)))
            if (fault := unreadable(folder)) is not None:
                self._tell(fault.code, fault.message, fault.fix, value, Doubt.PLUGINS)
            elif folder.is_dir():
                found.append(PluginFolder(folder, value.origin))
            else:
                fix = _neighbour(folder, path.parent)
                self._tell("missing-folder", f"there is no folder {folder}", fix, value, doubt=Doubt.PLUGINS)
        return found

    def _completed(self, path: Path, node: Value, scope: Scope) -> Value:
        """A node with its `parameters_from` laid under its `parameters`."""
        stated = node.members.get("parameters_from")
        if stated is None:
            return node
        layers: list[Value | None] = []
        for value in stated.content if isinstance(stated.content, list) else [stated]:
            target = Path(os.path.normpath(path.parent / str(value.content)))
            layers.append(self._parameters(target, value, scope))
        own = node.members.get("parameters")
        layers.append(own if own is not None and own.content is not None else None)
        present = [layer for layer in layers if layer is not None]
        merged = reduce(Value.merged, present) if present else Value({}, node.origin)
        return node.without(("parameters_from",)).with_member(("parameters",), merged)

    def _parameters(self, path: Path, entry: Value, scope: Scope) -> Value | None:
        """The parameters of a file that a node names."""
        via = (entry.origin.place, *entry.origin.included_from) if entry.origin.place is not None else ()
        if (path, via) not in self._parameter_files:  # the nodes of a for_each share one
            self._parameter_files[path, via] = self._read(path, entry, via)
        found = self._parameter_files[path, via]
        if found is None:
            return None
        if not isinstance(found.content, dict):
            message, fix = f"{path} must hold a mapping of parameters", "write `name: value` lines"
            self.problems.add(problem_at("wrong-type", message, fix, found.origin))
            return None
        resolver = Resolver(scope, self.problems)
        resolved = resolver.resolve(found)
        return without(resolved, resolver.failed)

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
            self.problems.add(*problems(once(told, tree), tree, noun="key"), doubt=None)
            if len(faults) >= MOST_FAULTS:
                raise LaunchError([])  # the rest would only repeat what is told
            tree, lost = mended(tree, faults)
            self._doubt(lost)

    def _tell(
        self, code: str, message: str, fix: str | None, entry: Value | None, doubt: Doubt | None = Doubt.NODES
    ) -> None:
        """A problem at the value that names a file, or at no place for the launch file itself."""
        origin = entry.origin if entry is not None else Origin(Source.CALLER)
        self.problems.add(problem_at(code, message, fix, origin), doubt=doubt)


def _neighbour(path: Path, beside: Path | None = None) -> str | None:
    """The file or folder beside a missing one that was probably meant, as a file in `beside` would name it."""
    try:
        if path.exists():
            return None
        if not path.parent.exists():
            return _neighbour(path.parent, beside) or f"there is no folder {path.parent}"
        for whole in (path.parent / f"{path.name}.yaml", path.parent / "configs" / f"{path.stem}.yaml"):
            if whole.is_file():  # `busflow run lab1`, said as one says it
                break
        else:
            near = nearest(path.name, [each.name for each in islice(path.parent.iterdir(), 1000)])
            whole = path.parent / near if near else None
    except (OSError, ValueError):
        return None
    return f"did you mean {str(whole) if beside is None else os.path.relpath(whole, beside)!r}?" if whole else None
