"""Finds the node classes in a plugin's files from their text alone; nothing is imported."""

from __future__ import annotations

import ast
import os
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from threading import Lock

UNREADABLE = (SyntaxError, ValueError, OSError, RecursionError, MemoryError)
"""The errors of reading a file that is not Python: bad syntax, null bytes, no permission, hostile nesting."""
_PARSING = Lock()
"""CPython 3.11 to 3.13 count nesting for all threads together: two that parse at once may fail with SystemError."""


@dataclass(frozen=True, slots=True)
class Definition:
    """A node class: where it is defined, and the first line of what it says about itself."""

    name: str
    file: Path
    line: int
    summary: str


class Outline:
    """Reads files, each once, and follows their relative imports to know which bases are nodes."""

    def __init__(self) -> None:
        self._read: dict[Path, dict[str, Definition]] = {}

    def of_plugin(self, path: Path) -> list[Definition]:
        """Return the node classes of `x.py` or `x/`: what `__init__.py` offers, else what the files hold.

        Raises:
            One of `UNREADABLE`: A file cannot be read as Python.
        """
        own = (path, path / "__init__.py")
        for files in ([file for file in own if file.is_file()], sources(path)):
            known = [each for file in files for each in self.of_file(file).values()]
            found = [each for each in known if path in (each.file, each.file.parent)]
            if found:
                return found
        return []

    def of_file(self, file: Path) -> dict[str, Definition]:
        """Return the names in a file that stand for node classes, defined there or imported."""
        if file in self._read:
            return self._read[file]
        found = self._read[file] = {}  # a circular import sees what is known so far
        with _PARSING, warnings.catch_warnings():  # the filters are those of all threads as well
            warnings.simplefilter("ignore")  # an invalid escape in the user's string is not ours to report
            tree = ast.parse(file.read_bytes(), file.name)
        for statement in ast.walk(tree):
            if isinstance(statement, ast.ImportFrom):
                found |= self._imported(statement, file)
        for statement in tree.body:
            if isinstance(statement, ast.ClassDef) and any(_is_node(base, found) for base in statement.bases):
                text = ast.get_docstring(statement) or ast.get_docstring(tree) or ""
                found[statement.name] = Definition(statement.name, file, statement.lineno, text.partition("\n")[0])
        return found

    def _imported(self, statement: ast.ImportFrom, file: Path) -> dict[str, Definition]:
        names = {each.name: each.asname or each.name for each in statement.names}
        if not statement.level:
            # Other packages are not read: what is called Node, or SomethingNode, is taken for one.
            return {local: Definition(name, Path(), 1, "") for name, local in names.items() if name.endswith("Node")}
        base = file.parents[statement.level - 1].joinpath(*(statement.module or "").split("."))
        known = self._of_module(base)
        if "*" in names:
            return known
        found = {local: known[name] for name, local in names.items() if name in known}
        for name, local in names.items():  # `from . import camera`, of which `camera.Camera` is a base
            found |= {f"{local}.{each}": definition for each, definition in self._of_module(base / name).items()}
        return found

    def _of_module(self, path: Path) -> dict[str, Definition]:
        """Return the names of a module of the folder; none where there is no such file, or nothing to read in it."""
        with suppress(*UNREADABLE):
            return self.of_file(path / "__init__.py" if path.is_dir() else path.with_suffix(".py"))
        return {}


def sources(path: Path) -> list[Path]:
    """Return the Python files of a plugin: the file itself, or those directly in its folder."""
    if os.path.isdir(path):  # noqa: PTH112  # Path.is_dir raises where the parent may not be read
        return sorted(each for each in path.glob("*.py") if each.is_file())
    return [path] if path.suffix == ".py" and os.path.isfile(path) else []  # noqa: PTH113  # the same


def files_with_nodes(path: Path) -> list[Path]:
    """Return the files of a package that define a node, and those whose mistakes only an import shows."""
    outline = Outline()

    def worth_importing(file: Path) -> bool:
        try:
            return any(each.file == file for each in outline.of_file(file).values())
        except UNREADABLE:
            return True

    return [file for file in sources(path) if file.stem != "__init__" and worth_importing(file)]


def _is_node(base: ast.expr, known: Mapping[str, Definition]) -> bool:
    is_known = isinstance(base, (ast.Name, ast.Attribute)) and ast.unparse(base) in known
    return is_known or (isinstance(base, ast.Attribute) and base.attr.endswith("Node"))
