"""Packages of definition files: a folder with `msg/`, `srv/` or `action/` in it, named by its `package.xml`.

Folders are listed within limits, and no file is opened but `package.xml`.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from busflow.definitions.definition import Kind

_DEPTH = 4
"""The deepest that packages lie in a folder of packages: `src/repository/group/package`."""
_MAX_FOLDERS = 5_000
"""The most folders that are looked into below one."""
_MAX_FILES = 5_000
"""The most files of one folder of definitions."""
_MAX_XML = 1 << 16
_SKIPPED = {"build", "install", "log", "node_modules", "__pycache__", "site-packages"}
_IGNORED = {"COLCON_IGNORE", "AMENT_IGNORE"}
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_NAME = re.compile(r"[a-z](_?[a-z0-9])*")
_TYPE = re.compile(r"[A-Z][A-Za-z0-9]*")


@dataclass(frozen=True)
class Package:
    """A package of definition files. Two are the same when their folders are."""

    folder: Path

    @cached_property
    def name(self) -> str:
        """The name in its `package.xml`, else that of the folder."""
        return next(self.stated("name"), self.folder.name)

    @cached_property
    def files(self) -> Mapping[str, Path]:
        """The files by the full name of the type that each defines."""
        found = ((kind, path) for kind, path in self._paths if path.suffix == f".{kind}")
        return {f"{self.name}/{kind}/{path.stem}": path for kind, path in found if _TYPE.fullmatch(path.stem)}

    @cached_property
    def misnamed(self) -> Sequence[Path]:
        """The files whose name can be no type's."""
        return [path for kind, path in self._paths if path.suffix == f".{kind}" and not _TYPE.fullmatch(path.stem)]

    @cached_property
    def idl(self) -> frozenset[str]:
        """The names of the types that only an `.idl` file defines, which busflow does not read."""
        names = (f"{self.name}/{kind}/{path.stem}" for kind, path in self._paths if path.suffix == ".idl")
        return frozenset(names) - self.files.keys()

    @property
    def unreadable(self) -> str:
        """Why it has no types, in words; empty if it has some."""
        if self.files:
            return ""
        if self.misnamed:
            return _no_type(self.misnamed[0])
        only = ", ".join(sorted(self.idl)[:3]) or "nothing"
        return f"{self.name} has no .msg, .srv or .action file, but {only}; busflow reads no .idl files"

    def unreadable_type(self, name: str) -> str:
        """Why a type of it cannot be used, in words; empty if it can, or nothing there has such a name."""
        short = name.rpartition("/")[2]
        for path in self.misnamed:
            if path.stem.replace("_", "").lower() == short.replace("_", "").lower():
                return _no_type(path)
        if not any(each.endswith(f"/{short}") for each in self.idl):
            return ""
        fix = "write it as a .msg, .srv or .action file"
        return f"{name} is defined in an .idl file alone, which busflow does not read; {fix}"

    def stated(self, tag: str) -> Iterator[str]:
        """Yield what `package.xml` has in an element: name, version, license."""
        for found in re.finditer(rf"<{tag}(?:\s[^>]*)?>([^<]*)</{tag}>", self._xml):
            yield found[1].strip()

    @cached_property
    def _xml(self) -> str:
        try:
            with (self.folder / "package.xml").open("rb") as file:
                return _COMMENT.sub("", file.read(_MAX_XML).decode("utf-8", "replace"))
        except OSError:
            return ""

    @cached_property
    def _paths(self) -> Sequence[tuple[Kind, Path]]:
        """All that lies in the folders of definitions."""
        folders = ((kind, self.folder / kind) for kind in Kind)
        return [(kind, folder / name) for kind, folder in folders for name in sorted(_names(folder, _MAX_FILES))]


def _no_type(path: Path) -> str:
    return f"{path} defines no type: name it in letters and digits, a capital first, such as Grip{path.suffix}"


def packages_in(folder: Path) -> list[Package]:
    """Return the packages in a folder: itself, or those below it, sorted by their folders."""
    return sorted(_walk(folder), key=lambda each: each.folder)


def by_name(folders: Iterable[Path]) -> dict[str, Package]:
    """Return the packages of folders by name; where two have one name the first is meant."""
    found: dict[str, Package] = {}
    for folder in folders:
        for package in packages_in(folder):
            if _NAME.fullmatch(package.name):
                found.setdefault(package.name, package)
    return found


def _walk(top: Path) -> Iterator[Package]:
    waiting, seen = [(top, 0)], 0
    while waiting and seen < _MAX_FOLDERS:
        folder, depth = waiting.pop()
        seen += 1
        names = set(_names(folder, _MAX_FILES))
        if depth and names & _IGNORED:
            continue
        if any(kind in names and (folder / kind).is_dir() for kind in Kind):
            yield Package(folder)
        elif depth < _DEPTH:
            inner = (each for each in names if not each.startswith(".") and each not in _SKIPPED)
            waiting += [(path, depth + 1) for path in (folder / each for each in inner) if path.is_dir()]


def _names(folder: Path, most: int) -> Iterator[str]:
    """Yield the names in a folder, at most so many; none where it cannot be read."""
    try:
        with os.scandir(folder) as entries:
            for _, entry in zip(range(most), entries, strict=False):
                yield entry.name
    except OSError:
        return
