"""Entry points: what installed distributions offer busflow by name, found without importing any of it."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from importlib.machinery import PathFinder
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint
    from pathlib import Path


def entry_points(group: str) -> Iterable[EntryPoint]:
    """Return the entry points of a group; importlib.metadata, 30 ms to import, is asked only if it may know some."""
    others = any(hasattr(finder, "find_distributions") for finder in sys.meta_path if finder is not PathFinder)
    if not others and not any(_may_offer(group, entry or ".") for entry in sys.path):
        return ()
    from importlib import metadata

    return metadata.entry_points(group=group)


def source_of(module: str) -> Path | None:
    """Return the file of a module, from folder to folder: `importlib.util.find_spec` would import its parents."""
    from pathlib import Path

    spec, search = None, None
    parts = module.split(".")
    for end in range(1, len(parts) + 1):
        spec = PathFinder.find_spec(".".join(parts[:end]), search)
        search = spec.submodule_search_locations if spec else []
    return Path(spec.origin) if spec and spec.origin else None


def _may_offer(group: str, entry: str) -> bool:
    """Return whether an entry of `sys.path` holds metadata that mentions the group, or is nothing to look into here."""
    try:
        with os.scandir(entry) as found:
            folders = [each.path for each in found if each.name.endswith((".dist-info", ".egg-info"))]
    except FileNotFoundError:
        return False
    except OSError:
        return True
    return any(group.encode() in _offers(folder) for folder in folders)


def _offers(folder: str) -> bytes:
    try:
        with open(f"{folder}/entry_points.txt", "rb") as file:  # noqa: PTH123  # pathlib takes 10 ms to import
            return file.read()
    except (FileNotFoundError, NotADirectoryError, IsADirectoryError):
        return b""
