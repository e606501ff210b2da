"""LaunchFileEdit: an edit of a launch file that can be looked at before it is written."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self

from busflow.launchfile.yaml.document import read_file
from busflow.launchfile.yaml.edit import edit


@dataclass(frozen=True, slots=True)
class LaunchFileEdit:
    """Text of a launch file as it is, and as it is to be."""

    file: Path
    before: str
    after: str

    @classmethod
    def of(cls, file: Path, edited: Callable[[str], str]) -> Self:
        """Read a launch file, its line ends included, and edit its text."""
        with file.open(encoding="utf-8", newline="") as stream:
            text = stream.read()
        return cls(file, text, edited(text))

    def write(self) -> None:
        """Write the text, all at once; nothing where it stays as it is."""
        if self.after == self.before:
            return
        draft = self.file.with_name(f".{self.file.name}.new")
        with draft.open("w", encoding="utf-8", newline="") as stream:
            stream.write(self.after)
        draft.chmod(self.file.stat().st_mode)
        draft.replace(self.file)


def launch_key(file: Path, key: str) -> Any:
    """Return the value of a top-level key of a launch file as plain data; None where it is not stated.

    Raises:
        LaunchError: The file cannot be read.
    """
    found = read_file(file, str(file)).members.get(key)
    return None if found is None else found.data


def saved_key(file: Path, key: str, value: object) -> LaunchFileEdit:
    """Return the edit that writes a top-level key into a launch file.

    Raises:
        LaunchError: The file cannot be read.
    """
    return LaunchFileEdit.of(file, lambda text: edit(text, (key,), value))
