"""`Library`: the types of folders of definition files, beside those that busflow brings; files are read when needed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from busflow.definitions.definition import TypeDefinition
from busflow.definitions.field_type import short_name
from busflow.definitions.packages import Package, by_name
from busflow.definitions.reader import MAX_BYTES, read_bytes
from busflow.errors import InvalidDefinition, Place, Problem, UnknownType
from busflow.interfaces.encoding.builtin_types import builtin_types
from busflow.interfaces.encoding.description import DEPTH, IndividualDescription, TypeDescription, assemble, rihs01
from busflow.text import did_you_mean, nearest, quoted

if TYPE_CHECKING:
    from busflow.interfaces.encoding.foreign import ForeignType


class Library:
    """Types by name: of the folders that a user names, of busflow, of the folders that are found, in this order.

    A package is taken from one place, whole.
    """

    def __init__(self, folders: Iterable[Path] = (), find: Callable[[], Iterable[Path]] = tuple) -> None:
        """Create the library of these folders, and of those that `find` returns when a type is first asked for."""
        self._folders, self._find = tuple(folders), find
        self._definitions: dict[str, TypeDefinition] = {}

    @cached_property
    def packages(self) -> dict[str, Package]:
        """The packages of definition files by name."""
        shipped = {name.partition("/")[0] for name in builtin_types().names}
        found = {name: each for name, each in by_name(self._find()).items() if name not in shipped}
        return found | by_name(self._folders)

    @cached_property
    def names(self) -> list[str]:
        """The names of all types that files define, sorted."""
        return sorted(name for package in self.packages.values() for name in package.files)

    def __contains__(self, name: str) -> bool:
        return self.owner(name) is not None

    def foreign(self, name: str) -> ForeignType:
        """Return a message, or a part of a service or action, for reading and writing without a class.

        Raises:
            UnknownType: There is no such type.
            InvalidDefinition: Its file has mistakes, or that of a type which it needs.
        """
        from busflow.interfaces.encoding.foreign import ForeignType

        described = self.description(name)
        return ForeignType(name, rihs01(described), described)

    def definition(self, name: str) -> TypeDefinition:
        """Return what the file of a type defines.

        Raises:
            UnknownType: There is no such type in these folders.
            InvalidDefinition: The file has mistakes.
        """
        if name not in self._definitions:
            self._definitions[name] = _read(name, self._file(name))
        return self._definitions[name]

    def description(self, name: str) -> TypeDescription:
        """Return the description of a type, or of a part of one: `my_msgs/srv/Grip_Request`.

        Raises:
            UnknownType: There is no such type.
            InvalidDefinition: Its file has mistakes, or that of a type which it needs, or there is none for that.
        """
        types: dict[str, IndividualDescription] = {}
        self._collect(name, None, types, ())
        return assemble(name, types)

    def _collect(
        self, name: str, place: Place | None, types: dict[str, IndividualDescription], around: tuple[str, ...]
    ) -> None:
        """Add a type and all within it."""
        owner = self.owner(name)
        if owner is None:
            self._collect_shipped(name, place, types)
            return
        if owner in around:
            chain = " in ".join([owner, *reversed(around[around.index(owner) :])][:DEPTH])
            raise _invalid("cycle", f"{owner} holds itself: {chain}", "hold its number or name in its place", place)
        if len(around) == DEPTH:
            raise _invalid("too-deep", f"types lie more than {DEPTH} deep within each other", None, place)
        definition = self.definition(owner)
        types |= definition.types()
        for needed, where in definition.needs():
            if needed not in types or needed in around or needed == owner:
                self._collect(needed, where, types, (*around, owner))

    def _collect_shipped(self, name: str, place: Place | None, types: dict[str, IndividualDescription]) -> None:
        builtin = builtin_types()
        if name in builtin:
            types |= builtin.within(name)
            return
        if place is None:
            raise self._unknown(name)
        short, package = short_name(name), name.partition("/")[0]
        known = [*self.names, *builtin.names]
        packages = {each.partition("/")[0] for each in known}
        if package not in packages:
            fix = f"{did_you_mean(package, packages)} (the folder of a package is named under `interfaces`)"
            raise _invalid("unknown-package", f"no package {quoted(package)} has definitions here", fix, place)
        messages = [short_name(each) for each in known if "/msg/" in each]
        guess = nearest(short, messages) or nearest(short.rpartition("/")[2], messages)
        fix = did_you_mean(guess or short, messages)
        raise _invalid("unknown-type", f"there is no message {quoted(short)}", fix, place)

    def unreadable(self, name: str) -> str:
        """Return why a type or package that is there cannot be used, in words; else nothing."""
        package, _, short = name.partition("/")
        found = self.packages.get(package)
        if found is None:
            return ""
        return found.unreadable_type(name) if short else found.unreadable

    def place(self, message: str, field: str) -> Place | None:
        """Return the place of a field of a message; None where no file defines it."""
        owner = self.owner(message)
        parts = () if owner is None else self.definition(owner).parts
        named = {each.field.name: each.place for part in parts if part.name == message for each in part.fields}
        return named.get(field)

    def owner(self, name: str) -> str | None:
        """Return the type whose file defines a type or a part of one; None where no file does."""
        package = self.packages.get(name.partition("/")[0])
        if package is None:
            return None
        whole = name.rpartition("_")[0]
        return next((each for each in (name, whole, whole.rpartition("_")[0]) if each in package.files), None)

    def _file(self, name: str) -> Path:
        owner = self.owner(name)
        if owner != name:
            raise self._unknown(name)
        return self.packages[name.partition("/")[0]].files[name]

    def _unknown(self, name: str) -> UnknownType:
        if unreadable := self.unreadable(name):
            return UnknownType(unreadable)
        return UnknownType(f"no type {quoted(name)}; {did_you_mean(name, [*self.names, *builtin_types().names])}")


def _read(name: str, file: Path) -> TypeDefinition:
    try:
        with file.open("rb") as opened:
            return read_bytes(name, opened.read(MAX_BYTES + 1), str(file))
    except OSError as error:
        problem = Problem("unreadable-file", f"{file} cannot be read: {error.strerror}")
    raise InvalidDefinition([problem])


def _invalid(code: str, message: str, fix: str | None, place: Place | None) -> InvalidDefinition:
    return InvalidDefinition([Problem(code, message, fix, place)])
