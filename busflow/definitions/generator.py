"""Generated modules: the source of packages in a folder, and whether it is what the definition files say today."""

from __future__ import annotations

import keyword
import os
import re
import shlex
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path

from busflow.definitions.library import Library
from busflow.definitions.python_module import Sources, module_text
from busflow.errors import InvalidDefinition, Place, Problem, Severity, UnknownType
from busflow.interfaces.encoding.builtin_types import SOURCES as SHIPPED
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.interfaces.encoding.description import TypeDescription, rihs01, types_in
from busflow.text import did_you_mean, quoted

_HASHED = re.compile(r"^#   (\S+) +(RIHS01_\w+)$", re.MULTILINE)
"""A line of a module's head: a file, and the hash of its type."""
_HEAD_LINES = 10
_NAMED = 5
"""The most files that a difference names."""


@dataclass(frozen=True, slots=True)
class Generated:
    """A module to write: its file, its text, and what is in the file now."""

    path: Path
    text: str
    present: str | None
    count: int
    """The number of its types."""
    left_out: tuple[Problem, ...]
    """The types that no class can be: a warning for each, with the field's place."""

    @property
    def is_current(self) -> bool:
        """True if the file holds the text."""
        return self.text == self.present

    @property
    def difference(self) -> str:
        """What has changed since the file was written, in words."""
        if self.present is None:
            return "is not there"
        then, now = (dict(_HASHED.findall(text)) for text in (self.present, self.text))
        if not then:
            return "was not written by busflow interface generate"
        changed = sorted(name for name in then.keys() & now.keys() if then[name] != now[name])
        words = {
            "has changed": changed,
            "is new": sorted(now.keys() - then.keys()),
            "is no longer there": sorted(then.keys() - now.keys()),
        }
        said = [f"{_some(names)} {word}" for word, names in words.items() if names]
        return "is out of date: " + ("; ".join(said) or "a comment, a default or a constant has changed, or the module")


def generate(library: Library, packages: Sequence[str], to: Path) -> list[Generated]:
    """Return the modules of packages for a folder; nothing is written.

    Raises:
        UnknownType: There is no such package.
        InvalidDefinition: A file has mistakes, or needs a package that no module there holds.
    """
    return [_generated(library, package, frozenset(packages), to) for package in dict.fromkeys(packages)]


def is_generated(module: Path) -> bool:
    """Return whether `busflow interface generate` wrote a module."""
    with module.open(encoding="utf-8") as file:
        return any(line.startswith("# busflow interface generate ") for line in islice(file, _HEAD_LINES))


def command(packages: Sequence[str], to: Path, folders: Sequence[Path] = ()) -> str:
    """Return the command that writes the modules from the definition files in these folders."""
    where = Path(os.path.relpath(to)) if to.is_absolute() else to
    named = [word for folder in folders for word in ("--interfaces", folder.as_posix())]
    return shlex.join(["busflow", "interface", "generate", *packages, *named, "--to", where.as_posix()])


def _some(names: list[str]) -> str:
    return ", ".join(names[:_NAMED]) + (f" and {len(names) - _NAMED} more" if names[_NAMED:] else "")


def _generated(library: Library, package: str, together: frozenset[str], to: Path) -> Generated:
    if package not in library.packages:
        raise UnknownType(
            f"no package {quoted(package)} of definition files; {did_you_mean(package, library.packages)}"
        )
    found = library.packages[package]
    if found.unreadable:
        raise UnknownType(found.unreadable)
    descriptions = {name: library.description(name) for name in found.files}
    impossible = {name: why for name, each in descriptions.items() if (why := _impossible(library, each))}
    definitions = [library.definition(name) for name in found.files if name not in impossible]
    if not definitions:
        raise InvalidDefinition(list(impossible.values()))

    def home(name: str, place: Place | None) -> str:
        return _home(name.partition("/")[0], together, to, place)

    described = " ".join([package, *found.stated("version")])
    licences = ", ".join(dict.fromkeys(found.stated("license")))
    hashes = {f"{each.kind}/{each.short}.{each.kind}": rihs01(descriptions[each.name]) for each in definitions}
    sources = Sources(command([package], to), f"{described} ({licences})" if licences else described, hashes)
    text = module_text(package, definitions, home, sources)
    path = to / f"{package}.py"
    present = path.read_text("utf-8") if path.is_file() else None
    left_out = tuple(replace(each, severity=Severity.WARNING) for each in impossible.values())
    return Generated(path, text, present, len(definitions), left_out)


def _impossible(library: Library, description: TypeDescription) -> Problem | None:
    """Return why a type cannot be a class, or None where it can; the types within it count too."""
    from busflow.interfaces.message import Message

    whole, python = description["type_description"]["type_name"], "a word of Python"
    for holder, each in types_in(description).items():
        word = next((word for word in holder.split("/") if keyword.iskeyword(word)), None)
        if word is not None:
            return Problem("invalid-name", f"{whole} can be no class: {word}, of {holder}, is {python}", None)
        for name in (field["name"] for field in each["fields"]):
            is_word = keyword.iskeyword(name) or name == "self"
            if is_word or hasattr(Message, name):
                why = python if is_word else "a method of every message"
                message = f"{whole} can be no class: {holder} has a field {name}, which is {why}"
                return Problem("invalid-name", message, None, library.place(holder, name))
    return None


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
