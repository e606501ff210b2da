"""The folders that `packages:` of a launch file names."""

from __future__ import annotations

import re
from pathlib import Path

from busflow.launchfile.model.problems import Problems, key_origin, problem_at
from busflow.launchfile.yaml.value import Value

_NAME = re.compile(r"[A-Za-z0-9][\w.-]*", re.ASCII)


def packages_of(stated: Value | None, problems: Problems) -> dict[str, Path]:
    """Return the folders by name; report names that no address can have, and folders that are not there."""
    found: dict[str, Path] = {}
    for name, value in stated.members.items() if stated is not None else ():
        folder = Path(str(value.content))
        if not _NAME.fullmatch(name):
            message, fix = f"{name!r} is no name of a package", "letters, digits, _, - and . make it"
            problems.add(problem_at("invalid-name", message, fix, key_origin(value)), left_out=[("packages",)])
        elif not folder.is_dir():
            message, fix = f"there is no folder {folder}", "name the package's folder, relative to this file"
            problems.add(problem_at("missing-folder", message, fix, value.origin), left_out=[("packages",)])
        else:
            found[name] = folder.resolve()
    return found
