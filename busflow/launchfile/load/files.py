"""Reads the files and folders that a launch file names, within the limits of one load; reports missing ones."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import chain, islice
from pathlib import Path

from busflow.errors import KeyPath, LaunchError, Place, Problem
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.parameter_file import of_node
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.key_faults import without
from busflow.launchfile.model.misplaced import with_keys_in_place
from busflow.launchfile.model.problems import Problems, problem_at
from busflow.launchfile.yaml.document import MAX_BYTES, Limits, Repeated, read_file
from busflow.launchfile.yaml.value import Origin, StatedBy, StatedPath, Value
from busflow.text import nearest
from busflow.validation.folders import unreadable

MAX_FILES = 100
_LOOKED_AT = 1000
"""The most files of a folder among which one with a similar name is looked for."""


@dataclass(slots=True)
class Files:
    """Reads the files of one load and collects their problems."""

    problems: Problems
    plugins: Callable[[], Iterable[str]] = tuple
    """The names of plugins, for the error where one is given instead of a file."""
    limits: Limits = field(default_factory=Limits)
    paths: list[Path] = field(default_factory=list[Path])
    """All files read, in order."""
    _parameters: dict[tuple[Path, tuple[Place, ...]], Value | None] = field(
        default_factory=dict[tuple[Path, tuple[Place, ...]], "Value | None"]
    )

    def launch_file(self, path: Path, entry: Value | None) -> Value | None:
        """Return the content of a launch file, misplaced keys moved; None if it cannot be read.

        Args:
            path: The file.
            entry: The value that names it; None for the file that is launched.
        """
        repeated: Repeated = []
        root = self._read(path, entry, repeated)
        return with_keys_in_place(root, repeated, self.problems) if root is not None else None

    def parameters(self, path: Path, entry: Value, node: str, scope: Scope | None = None) -> Value | None:
        """Return the parameters of a node in a file that it names; None if they cannot be read.

        Args:
            path: The file.
            entry: The value that names it.
            node: The node's full name.
            scope: The meaning of the file's expressions; without it they stay text, as in a file of ROS 2's form.
        """
        asked = path, entry.origin.trail
        if asked not in self._parameters:  # the nodes of a for_each share one
            self._parameters[asked] = self._read(path, entry)
        found = self._parameters[asked]
        if found is None:
            return None
        if not isinstance(found.content, dict):
            message, fix = f"{path} must hold a mapping of parameters", "write `name: value` lines"
            self.problems.add(problem_at("wrong-type", message, fix, found.origin))
            return None
        try:
            own = of_node(found, node, entry.origin)
        except LaunchError as error:
            self.problems.add(*error.problems, left_out=[("defaults", "parameters")])
            return None
        if scope is None or own is not found:
            return own
        resolver = Resolver(scope, self.problems)
        return without(resolver.resolve(own), resolver.failed)

    def folders(self, tree: Value, key: str, beside: Path) -> list[StatedPath]:
        """Return the folders stated under a key of a file, relative to its own folder; report missing ones."""
        stated = tree.members.get(key)
        found: list[StatedPath] = []
        for value in stated.content if stated is not None and isinstance(stated.content, list) else ():
            folder = Path(os.path.normpath(beside / str(value.content)))
            fault = unreadable(folder)
            if fault is None and folder.is_dir():
                found.append(StatedPath(folder, value.origin))
                continue
            if fault is None:
                fault = Problem("missing-folder", f"there is no folder {folder}", _neighbour(folder, beside))
            self._report(fault.code, fault.message, fault.fix, value, (key,))
        return found

    def _read(self, path: Path, entry: Value | None, repeated: Repeated | None = None) -> Value | None:
        """Return a file's content; None if it cannot be read. An unreadable file is reported at its `entry`."""
        if self.limits.values < 0:
            raise LaunchError([])  # an earlier file was too large, which is reported already
        if len(self.paths) >= MAX_FILES:
            self._report("too-many-files", f"more than {MAX_FILES} files are read", "include less", entry)
            raise LaunchError([])
        self.paths.append(path)
        try:
            return read_file(path, str(path), entry.origin.trail if entry is not None else (), self.limits, repeated)
        except LaunchError as error:
            for problem in error.problems:
                if problem.code == "unreadable-file":
                    place = entry.origin.place if entry is not None else None
                    fix = _neighbour(path, Path(place.file).parent if place is not None else None, self.plugins)
                    lost = () if repeated is not None else ("defaults", "parameters")
                    self._report(problem.code, problem.message, fix, entry, lost)
                else:
                    self.problems.add(problem)
        return None

    def _report(self, code: str, message: str, fix: str | None, entry: Value | None, left_out: KeyPath = ()) -> None:
        """Report a problem at the value that names a file; without a place for the launch file itself."""
        origin = entry.origin if entry is not None else Origin(StatedBy.CALLER)
        self.problems.add(problem_at(code, message, fix, origin), left_out=[left_out])


def _neighbour(path: Path, beside: Path | None, plugins: Callable[[], Iterable[str]] = tuple) -> str | None:
    """Suggest what exists for a missing file or folder, or is in a folder, relative to `beside`."""
    try:
        if path.exists() and not path.is_dir():
            return None
        found = min(islice(path.glob("*.yaml"), _LOOKED_AT), default=None) if path.is_dir() else _nearest(path)
        if found is None and beside is None and (plugin := _plugin(path, plugins)):
            return plugin
    except (OSError, ValueError):
        return None
    if found is not None:
        return f"did you mean {str(found) if beside is None else os.path.relpath(found, beside)!r}?"
    missing = next((each for each in reversed(path.parents) if not each.exists()), None)
    return f"there is no folder {missing}" if missing is not None else None


def _nearest(path: Path) -> Path | None:
    """Return the file or folder whose name is nearest to that of a missing one, else the nearest folder above it."""
    folder = path.parent if path.parent.exists() else _nearest(path.parent)
    if folder is None or not folder.is_dir():
        return None
    for whole in (folder / path.name, folder / f"{path.name}.yaml", folder / "configs" / f"{path.stem}.yaml"):
        if whole.is_file():  # for instance `busflow run lab1`
            return whole
    others = [each.name for each in islice(folder.iterdir(), _LOOKED_AT) if each.name != path.name]  # a broken link
    near = nearest(path.name, others)
    return folder / near if near else folder if folder != path.parent else None


def _plugin(path: Path, plugins: Callable[[], Iterable[str]]) -> str | None:
    """Suggest a launch file that runs a plugin, where the name of one is given instead of a file."""
    name = str(path)
    if name not in plugins():
        return None
    alone = f"{name} is a plugin, which busflow run --plugin {name} runs alone"
    stated = re.compile(rf"plugin:\s*{re.escape(name)}\b")
    for file in sorted(islice(chain(Path().glob("*.yaml"), Path("configs").glob("*.yaml")), _LOOKED_AT)):
        if file.stat().st_size <= MAX_BYTES and stated.search(file.read_text("utf-8", errors="replace")):
            return f"{alone}: or did you mean {str(file)!r}?"
    return f"{alone}; in a file, nodes: {{{name}: {{plugin: {name}}}}}"
