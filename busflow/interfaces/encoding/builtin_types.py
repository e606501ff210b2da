"""The message types that busflow brings: names, fields and comments, without importing any class.

Importing the classes costs pydantic and numpy. So the build hook, `hatch_build.py`, writes what their sources say into
a file beside this one. A clone whose messages have been changed since then is recognised by their fingerprint.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from busflow.errors import UnknownType
from busflow.interfaces.encoding.description import IndividualDescription, TypeDescription, assemble

SOURCES = Path(__file__).parents[2] / "msgs"
DATA = Path(__file__).with_suffix(".json")


@dataclass(frozen=True, slots=True)
class Comments:
    """The docstrings of a type and of its fields."""

    text: str = ""
    fields: Mapping[str, str] = field(default_factory=dict[str, str])


class BuiltinTypes:
    """The built-in types by full name."""

    def __init__(self, data: Mapping[str, Any]) -> None:
        """Take the types from the data that the build hook wrote."""
        self._types: Mapping[str, IndividualDescription] = data["types"]
        self._comments: Mapping[str, Mapping[str, Any]] = data["comments"]
        self.messages: list[str] = sorted(name for name in self._types if "/msg/" in name)
        """The names of the messages, those that are part of a service left out."""
        self.services: list[str] = data["services"]
        """The names of the services."""
        self.actions: list[str] = data["actions"]
        """The names of the actions."""

    def __contains__(self, name: str) -> bool:
        return name in self._types

    @property
    def names(self) -> list[str]:
        """The names of all: messages, services, actions."""
        return [*self.messages, *self.services, *self.actions]

    def description(self, name: str) -> TypeDescription:
        """Return the description of a message, or of a part of a service or action: `…_Request`, `…_Goal`."""
        return assemble(name, self.within(name))

    def within(self, name: str) -> dict[str, IndividualDescription]:
        """Return a message or a part, and all messages within it, by name."""
        types: dict[str, IndividualDescription] = {}
        waiting = [name]
        while waiting:
            each = waiting.pop()
            if each not in types:
                types[each] = self._types[each]
                nested = [one["type"]["nested_type_name"] for one in types[each]["fields"]]
                waiting += [one for one in nested if one]
        return types

    def comments(self, name: str) -> Comments:
        """Return the docstrings of a message, of a service, or of one half of a service."""
        return Comments(**self._comments[name])


@cache
def builtin_types() -> BuiltinTypes:
    """Return the built-in types; the file is read once.

    Raises:
        UnknownType: They have not been written, or not from these sources.
    """
    return BuiltinTypes(read(DATA, SOURCES))


def read(file: Path, sources: Path) -> Mapping[str, Any]:
    """Return the description that the build hook wrote for these sources.

    Raises:
        UnknownType: It has not, or the sources have been changed since.
    """
    try:
        data = json.loads(file.read_bytes())
    except (OSError, ValueError):
        raise _stale(file, "is not there: busflow runs from a clone that was never installed") from None
    if data["sources"] != fingerprint(sources):
        raise _stale(file, f"was made of other messages than those in {sources}")
    return data


def fingerprint(sources: Path) -> str:
    """Return the SHA-256 of the files below a folder."""
    found = hashlib.sha256()
    for path in sorted(sources.rglob("*.py")):
        content = path.read_bytes()
        found.update(f"{path.relative_to(sources).as_posix()} {len(content)}\n".encode() + content)
    return found.hexdigest()


def _stale(file: Path, why: str) -> UnknownType:
    import shlex

    root = file.parents[3]
    command = (
        f"pip install -e {shlex.quote(str(root))}" if (root / "pyproject.toml").is_file() else "install busflow again"
    )
    return UnknownType(f"{file}, which describes busflow's own messages, {why}; {command}")
