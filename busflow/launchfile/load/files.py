"""Reads the files and folders that a launch file names, within the limits of one load; reports missing ones."""

from __future__ import annotations

import os
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path

from busflow.errors import KeyPath, LaunchError, Place, Problem
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.parameter_file import of_node
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.key_faults import without
from busflow.launchfile.model.misplaced import with_keys_in_place
from busflow.launchfile.model.problems import Problems, problem_at
from busflow.launchfile.yaml.document import Limits, Repeated, read_file
from busflow.launchfile.yaml.value import Origin, StatedBy, StatedPath, Value
from busflow.node.plugins import unreadable
from busflow.text import nearest

MAX_FILES = 100


@dataclass(slots=True)
class Files:
    """Reads the files of one load and collects their problems."""

    problems: Problems
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

    def folders(self, stated: Value | None, beside: Path) -> list[StatedPath]:
        """Return the plugin folders stated in a file, relative to its folder; report missing ones."""
        found: list[StatedPath] = []
        for value in stated.content if stated is not None and isinstance(stated.content, list) else ():
            folder = Path(os.path.normpath(beside / str(value.content)))
            fault = unreadable(folder)
            if fault is None and folder.is_dir():
                found.append(StatedPath(folder, value.origin))
                continue
            if fault is None:
                fault = Problem("missing-folder", f"there is no folder {folder}", _neighbour(folder, beside))
            self._report(fault.code, fault.message, fault.fix, value, ("plugins",))
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
                    fix = _neighbour(path, Path(place.file).parent if place is not None else None)
                    lost = () if repeated is not None else ("defaults", "parameters")
                    self._report(problem.code, problem.message, fix, entry, lost)
                else:
                    self.problems.add(problem)
        return None

    def _report(self, code: str, message: str, fix: str | None, entry: Value | None, left_out: KeyPath = ()) -> None:
        """Report a problem at the value that names a file; without a place for the launch file itself."""
        origin = entry.origin if entry is not None else Origin(StatedBy.CALLER)
        self.problems.add(problem_at(code, message, fix, origin), left_out=[left_out])


def _neighbour(path: Path, beside: Path | None = None) -> str | None:
    """Suggest an existing file or folder for a missing one, relative to `beside`."""
    try:
        if path.exists():
            return None
        if not path.parent.exists():
            return _neighbour(path.parent, beside) or f"there is no folder {path.parent}"
        for whole in (path.parent / f"{path.name}.yaml", path.parent / "configs" / f"{path.stem}.yaml"):
            if whole.is_file():  # for instance `busflow run lab1`
                break
        else:
            near = nearest(path.name, [each.name for each in islice(path.parent.iterdir(), 1000)])
            whole = path.parent / near if near else None
    except (OSError, ValueError):
        return None
    return f"did you mean {str(whole) if beside is None else os.path.relpath(whole, beside)!r}?" if whole else None
