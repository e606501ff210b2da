"""Whether a folder of plugins can be looked into."""

from __future__ import annotations

import os
from pathlib import Path

from busflow.errors import Problem
from busflow.text import printable


def unreadable(folder: Path) -> Problem | None:
    """Why nobody can look into a folder that is there; None where one can."""
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
