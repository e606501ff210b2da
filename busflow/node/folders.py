"""Plugin folders as packages: the name below `busflow.node.folders` spells the folder, so each interpreter finds it.

So another process that unpickles what a plugin's file defines, e.g. a pool's, imports that file. Two folders called
`plugins` never meet, and a file that is already imported is that module.
"""

from __future__ import annotations

import importlib.util
import os
import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from importlib.machinery import ModuleSpec, PathFinder
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    from importlib.abc import Loader  # importing it when running costs 10 ms

__path__: list[str] = []
"""Makes this module a package for `import`; its own finder knows what is in it."""
PREFIX = f"{__name__}."
"""Beginning of the name of each plugin's module."""


def package_of(folder: Path) -> str:
    """Return the name of the package that a folder is in this process."""
    init = folder / "__init__.py"
    known = _loaded(init) if init.is_file() else None
    return known.__name__ if known else PREFIX + _spelled(os.fsencode(folder))


def file_of(module: ModuleType) -> str | None:
    """Return the file of a module, if it has one."""
    file = getattr(module, "__dict__", {}).get("__file__")  # a lazy module may run code in getattr
    return file if isinstance(file, str) else None


def _spelled(folder: bytes) -> str:
    r"""Return a path as one word; `_folder` reads it.

    >>> _spelled(b"/home/my_robot")
    '_2fhome_2fmy_5frobot'
    """
    spelled = re.sub(rb"[^A-Za-z0-9]", lambda found: b"_%02x" % found[0][0], folder)
    return spelled.decode("ascii")


def _folder(spelled: str) -> str:
    r"""Return the path that a word spells.

    >>> _folder("_2fhome_2fmy_5frobot")
    '/home/my_robot'
    """
    path = re.sub(rb"_([0-9a-f]{2})", lambda found: bytes.fromhex(found[1].decode()), spelled.encode())
    return os.fsdecode(path)


class _Finder:
    """Answers `import` for plugin folders and the files in them."""

    @classmethod
    def find_spec(
        cls, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if not name.startswith(PREFIX):
            return None
        spelled, _, file = name.removeprefix(PREFIX).partition(".")
        if not file:
            return _spec_of_folder(name, Path(_folder(spelled)))
        spec = PathFinder.find_spec(name, path, target)
        known = _loaded(Path(spec.origin)) if spec and spec.origin else None
        return ModuleSpec(name, cast("Loader", _Reuse(known))) if known else spec


def _spec_of_folder(name: str, folder: Path) -> ModuleSpec | None:
    if not folder.is_dir():
        return None
    init = folder / "__init__.py"
    location = importlib.util.spec_from_file_location(name, init) if init.is_file() else None
    spec = location or ModuleSpec(name, None, is_package=True)
    spec.submodule_search_locations = [str(folder)]
    return spec


class _Reuse:
    """Lets a module stand in `sys.modules` under a second name."""

    def __init__(self, module: ModuleType) -> None:
        self._module = module

    def create_module(self, spec: ModuleSpec) -> None:  # noqa: ARG002  # the import system's signature
        return None

    def exec_module(self, module: ModuleType) -> None:
        sys.modules[module.__name__] = self._module


def _loaded(path: Path) -> ModuleType | None:
    """Return the module that was imported from this very file, if any."""
    files = [(file, module) for module in list(sys.modules.values()) if (file := file_of(module))]
    if (same := next((module for file, module in files if file == str(path)), None)) is not None:
        return same  # a run under a thousand seeds asks a thousand times
    wanted = path.stat()
    for file, module in files:
        with suppress(OSError, ValueError):
            if not os.path.samestat(os.stat(file), wanted):  # noqa: PTH116  # of hundreds of files
                continue
            # The inode is the quick answer; hard links, as installers make them, are two files all the same.
            if Path(file).resolve() == path.resolve():
                return module
    return None


sys.meta_path.insert(0, _Finder)
