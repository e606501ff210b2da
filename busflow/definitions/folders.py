"""Folders of definition files: those that a command line names, and those that are found on this machine."""

from __future__ import annotations

import os
from collections.abc import Iterable
from functools import cache
from pathlib import Path

from busflow.definitions.library import Library
from busflow.entry_points import entry_points, source_of

GROUP = "busflow.interfaces"
"""The group of entry points by which an installed package names a module beside whose file its definition files lie."""

_named: list[Path] = []


def name_folders(folders: Iterable[Path]) -> None:
    """Take the folders that a command line names into the library of this process."""
    _named[:] = folders
    library.cache_clear()


def named_folders() -> list[Path]:
    """Return the folders that the command line names."""
    return list(_named)


@cache
def library() -> Library:
    """Return the types of this process: of the named folders, of busflow, and of the folders that are found."""
    return Library(_named, found_folders)


def found_folders() -> list[Path]:
    """Return the folders of installed packages that offer definition files, then those of a sourced ROS 2."""
    installed = [source_of(each.module) for each in entry_points(GROUP)]
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return [*(each.parent for each in installed if each), *(Path(each, "share") for each in prefixes if each)]
