"""Folders that are named by a user: the reason why one cannot be read."""

from __future__ import annotations

import os
from pathlib import Path

from busflow.errors import Problem
from busflow.text import printable


def unreadable(folder: Path) -> Problem | None:
    """Return the reason why an existing folder cannot be read; None if it can, or is not there."""
    try:
        with os.scandir(folder) as entries:
            next(entries, None)
        os.stat(folder / "__init__.py")  # noqa: PTH116  # what is listed may be out of reach all the same
    except (FileNotFoundError, NotADirectoryError):
        return None
    except OSError as error:
        message = f"cannot read the folder {printable(folder)}: {error.strerror}"
        return Problem("unreadable-folder", message, f"let it be read: chmod u+rx {printable(folder)}")
    return None
