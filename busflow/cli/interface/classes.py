"""The message, service and action classes of a module, of a Python package, or of a folder of plugins."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from busflow.errors import InvalidInput, Problem
from busflow.interfaces.action import ActionType
from busflow.interfaces.encoding.typesupport import OpaqueMessage
from busflow.interfaces.message import Message, ServiceType, type_name
from busflow.node.plugins import find, load
from busflow.text import printable


def classes_of(name: str) -> tuple[str, list[type[Any]]]:
    """Return the package of ROS 2 to which the classes belong, and the classes.

    Raises:
        InvalidInput: There is no such module, it has no types, or types of several packages.
    """
    folder = _imported(name)
    found = [cls for cls in _types() if (file := _file_of(cls)) and folder in (file, *file.parents)]
    packages = sorted({type_name(cls).partition("/")[0] for cls in found})
    if not packages:
        raise _refused(f"{printable(name)} has no message, service or action classes")
    named = [each for each in packages if each == name.rpartition(".")[2]]
    if len(packages) > 1 and not named:
        raise _refused(f"{printable(name)} has types of several packages, {', '.join(packages)}; name a module of one")
    package = (named or packages)[0]
    return package, [cls for cls in found if type_name(cls).startswith(f"{package}/")]


def _imported(name: str) -> Path:
    """Import a module with what lies in it; return its folder or file."""
    if Path(name).is_dir() and not Path(name, "__init__.py").exists():
        for plugin in find([Path(name)]):
            load(plugin.name, (Path(name),))
        return Path(name).resolve()
    sys.path.insert(0, str(Path.cwd()))
    try:
        module = importlib.import_module(name.strip("/").replace("/", "."))
        for each in pkgutil.walk_packages(getattr(module, "__path__", []), f"{module.__name__}."):
            importlib.import_module(each.name)
    except ImportError as error:
        raise _refused(f"{printable(name)} cannot be imported: {printable(error)}") from None
    finally:
        sys.path.remove(str(Path.cwd()))
    file = Path(inspect.getfile(module)).resolve()
    return file.parent if file.name == "__init__.py" else file


def _types() -> Iterator[type[Any]]:
    """Yield all classes of types that have been imported, the parts of services and actions left out."""
    waiting: list[type[Any]] = [Message, ServiceType, ActionType]
    while waiting:
        for cls in waiting.pop().__subclasses__():
            waiting.append(cls)
            is_part = "." in cls.__qualname__ and issubclass(cls, Message)  # a service may stand in a class around it
            if not is_part and not issubclass(cls, OpaqueMessage):
                yield cls


def _file_of(cls: type[Any]) -> Path | None:
    try:
        return Path(inspect.getfile(cls)).resolve()
    except (OSError, TypeError):  # made by a program that is no file, or built in
        return None


def _refused(message: str) -> InvalidInput:
    return InvalidInput(Problem("no-types", message, "write the name of a module that has them"))
