"""Loads a launch file: merges its includes, arguments and overrides into one `LaunchDescription`.

Later sources override earlier ones: a plugin's default < an included file < the file < the command line. All problems
are collected: wrong parts are left out, and the rest is still checked.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from busflow.errors import LaunchError
from busflow.launchfile.load import arguments, override
from busflow.launchfile.load.build import Builder
from busflow.launchfile.load.expression import Scope
from busflow.launchfile.load.files import Files
from busflow.launchfile.load.part import LaunchFile, part_of
from busflow.launchfile.load.profiles import from_command_line
from busflow.launchfile.load.resolver import Resolver
from busflow.launchfile.model.description import Examined, LaunchDescription
from busflow.launchfile.model.doubts import Doubt, doubts
from busflow.launchfile.model.key_faults import checked
from busflow.launchfile.model.problems import Problems, problem_at
from busflow.launchfile.yaml.document import read_file


def examine(
    path: str | Path,
    *,
    args: Mapping[str, object] | None = None,
    assignments: Sequence[str] = (),
    sets: Sequence[str] = (),
    profiles: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
    plugins: Callable[[], Iterable[str]] = tuple,
) -> Examined:
    """Load a launch file; return the description of its correct parts, and every problem.

    Args:
        path: The file.
        args: Values of its arguments, from Python.
        assignments: `name:=value` of a command line.
        sets: `path=value` of a command line's `--set`.
        profiles: The profiles of the file to use; later ones override earlier ones.
        environment: The variables for `${env.…}`; by default the process's own.
        plugins: Gives the names of plugins, for the error where one stands in place of a file.
    """
    problems = Problems()
    files = Files(problems, plugins)
    given = arguments.from_caller(args or {}) | arguments.from_command_line(assignments, problems)
    changes = override.parsed(sets, problems)
    description: LaunchDescription | None = None
    with problems.collecting():
        file = LaunchFile(Path(path), from_command_line(profiles), given)
        outside = Scope(environment if environment is not None else os.environ)
        description = _described(file, changes, files, outside)
    return description, problems.sorted(map(str, files.paths))


def load(
    path: str | Path,
    *,
    args: Mapping[str, object] | None = None,
    assignments: Sequence[str] = (),
    sets: Sequence[str] = (),
    profiles: Sequence[str] = (),
    environment: Mapping[str, str] | None = None,
    plugins: Callable[[], Iterable[str]] = tuple,
) -> LaunchDescription:
    """Load a launch file; the arguments are as for `examine`.

    Raises:
        LaunchError: With every problem.
    """
    description, found = examine(
        path,
        args=args,
        assignments=assignments,
        sets=sets,
        profiles=profiles,
        environment=environment,
        plugins=plugins,
    )
    if found or description is None:
        raise LaunchError(found)
    return description


def read_arguments(path: str | Path, environment: Mapping[str, str] | None = None) -> tuple[arguments.Argument, ...]:
    """Return the arguments that a launch file declares, for its help; those without a default have no value.

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


def _described(
    file: LaunchFile, changes: Iterable[override.Override], files: Files, outside: Scope
) -> LaunchDescription | None:
    """Return the description of a file with these overrides; None if it cannot be read."""
    problems, part = files.problems, part_of(file, files, outside)
    if part is None:
        return None
    changes = override.with_parameter_files(changes, part.tree, files)
    keys, part.tree = checked(override.applied(part.tree, changes, problems), problems)
    description = Builder(part, keys, problems).build(file.path.stem, tuple(files.paths))
    if not description.nodes and not description.programs and not problems:
        message, fix = "the file names no nodes: there is nothing to run", "add `nodes:`"
        if keys.nodes or keys.programs:
            message, fix = "every node is left out by its `when`: there is nothing to run", None
        problems.add(problem_at("no-nodes", message, fix, part.tree.origin))
    unknown = doubts(problems.left_out)
    return replace(description, warnings=() if Doubt.NODES in unknown else tuple(part.warnings), doubts=unknown)
