"""Generated modules: the source of packages in a folder, and whether it is what the definition files say today."""

from __future__ import annotations

import os
import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from busflow.definitions.library import Library
from busflow.definitions.python_module import Sources, module_text
from busflow.errors import InvalidDefinition, Place, Problem, UnknownType
from busflow.interfaces.encoding.builtin_types import SOURCES as SHIPPED
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.interfaces.encoding.description import rihs01
from busflow.text import did_you_mean, quoted


@dataclass(frozen=True, slots=True)
class Generated:
    """A module to write: its file, its text, and what is in the file now."""

    path: Path
    text: str
    present: str | None

    @property
    def is_current(self) -> bool:
        """True if the file holds the text."""
        return self.text == self.present


def generate(library: Library, packages: Sequence[str], to: Path) -> list[Generated]:
    """Return the modules of packages for a folder; nothing is written.

    Raises:
        UnknownType: There is no such package.
        InvalidDefinition: A file has mistakes, or needs a package that no module there holds.
    """
    return [_generated(library, package, frozenset(packages), to) for package in dict.fromkeys(packages)]


def command(packages: Sequence[str], to: Path) -> str:
    """Return the command that writes the modules."""
    where = Path(os.path.relpath(to)) if to.is_absolute() else to
    return shlex.join(["busflow", "interface", "generate", *packages, "--to", where.as_posix()])


def _generated(library: Library, package: str, together: frozenset[str], to: Path) -> Generated:
    if package not in library.packages:
        raise UnknownType(
            f"no package {quoted(package)} of definition files; {did_you_mean(package, library.packages)}"
        )
    found = library.packages[package]
    if not found.files:
        idl = ", ".join(sorted(found.idl)[:3]) or "nothing"
        raise UnknownType(f"{package} has no .msg, .srv or .action file, but {idl}; busflow reads no .idl files")
    definitions = [library.definition(name) for name in found.files]

    def home(name: str, place: Place | None) -> str:
        return _home(name.partition("/")[0], together, to, place)

    described = " ".join([package, *found.stated("version")])
    licences = ", ".join(dict.fromkeys(found.stated("license")))
    hashes = {f"{each.kind}/{each.short}.{each.kind}": rihs01(library.description(each.name)) for each in definitions}
    sources = Sources(command([package], to), f"{described} ({licences})" if licences else described, hashes)
    text = module_text(package, definitions, home, sources)
    path = to / f"{package}.py"
    return Generated(path, text, path.read_text("utf-8") if path.is_file() else None)


def _home(package: str, together: frozenset[str], to: Path, place: Place | None) -> str:
    """Return the module that holds a package's classes, as a module in the folder `to` imports it."""
    shipped = any(each.startswith(f"{package}/") for each in builtin_types().names)
    if to.resolve() == SHIPPED.resolve() or (shipped and package not in together):
        return f"busflow.msgs.{package}"
    if package in together or (to / f"{package}.py").is_file():
        return f".{package}"
    message = f"{package} is in no module beside this one"
    fix = f"write both: {command([*sorted(together), package], to)}"
    raise InvalidDefinition([Problem("missing-package", message, fix, place)])
