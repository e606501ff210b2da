"""Reads annotations in a node's class as they are written, with the names in scope around the class."""

from __future__ import annotations

import importlib
import inspect
import pkgutil
import re
import sys
import typing
from collections.abc import Callable, Mapping
from types import FrameType, SimpleNamespace
from typing import Any

from busflow.errors import InvalidDeclaration
from busflow.node.folders import PREFIX
from busflow.validation.as_written import written_annotations


def message_annotation(function: Callable[..., Any]) -> Any:
    """Return the annotation of the first parameter after `self`, as written, or None."""
    code = getattr(function, "__code__", None)
    if code is None or code.co_argcount < 2:
        return None
    return written_annotations(function).get(code.co_varnames[1])


def takes_one(function: Callable[..., Any]) -> bool:
    """Return whether a method can be called with itself and one more thing, as far as its signature shows."""
    code = getattr(function, "__code__", None)
    if code is None:
        return True
    fewest = code.co_argcount - len(getattr(function, "__defaults__", None) or ())
    return fewest <= 2 and (code.co_argcount >= 2 or bool(code.co_flags & inspect.CO_VARARGS))


def takes_none(function: Callable[..., Any]) -> bool:
    """Return whether a method can be called with nothing but itself, as far as its signature shows."""
    code = getattr(function, "__code__", None)
    if code is None:
        return True
    fewest = code.co_argcount - len(getattr(function, "__defaults__", None) or ())
    return fewest <= 1 and (code.co_argcount >= 1 or bool(code.co_flags & inspect.CO_VARARGS))


def line_of(function: object) -> tuple[str, int] | None:
    """Return the file and the line where a function begins, its decorators included; None for what has no code."""
    code = getattr(function, "__code__", None)
    return None if code is None else (code.co_filename, code.co_firstlineno)


def calling_line() -> tuple[str, int] | None:
    """Return the file and the line outside this package from which it was called."""
    frame: FrameType | None = sys._getframe(1)  # noqa: SLF001  # as below
    while frame is not None and (name := frame.f_globals.get("__name__", "")).startswith("busflow."):
        if name.startswith(PREFIX):
            break
        frame = frame.f_back
    return None if frame is None else (frame.f_code.co_filename, frame.f_lineno)


def names_used(annotation: str, frame: FrameType) -> dict[str, Any]:
    """Return the names in scope in the function around a class, if there is one."""
    words = set(re.findall(r"[A-Za-z_]\w*", annotation))
    return {word: frame.f_locals[word] for word in words if word in frame.f_locals}


def resolve(annotation: str, names: dict[str, Any], surroundings: Mapping[str, Any], origin: str) -> Any:
    """Return the object that an annotation names.

    Raises:
        InvalidDeclaration: a name in it is not known when the program runs.
    """
    holder = SimpleNamespace(__annotations__={"it": annotation})
    try:
        return typing.get_type_hints(holder, names, dict(surroundings))["it"]
    except NameError as error:
        found = import_of(str(error.name))
        raise InvalidDeclaration(
            f"{origin} is annotated with {annotation!r}, but {error.name!r} is not defined when the program runs; "
            f"{f'write `{found}`' if found else 'import it'} outside `if TYPE_CHECKING:`"
        ) from None
    except (SyntaxError, TypeError, AttributeError) as error:
        raise InvalidDeclaration(f"{origin} is annotated with {annotation!r}: {error}") from None


def import_of(name: str) -> str | None:
    """Return the import statement for one of busflow's names or for a standard message.

    >>> import_of("timer"), import_of("Imu")
    ('from busflow import timer', 'from busflow.msgs.sensor_msgs import Imu')
    """
    packages = [each.name for each in pkgutil.iter_modules(importlib.import_module("busflow.msgs").__path__)]
    packages.sort(key="example_interfaces".__eq__)  # last: it has the names of std_msgs as well
    for module in ("busflow", *(f"busflow.msgs.{each}" for each in packages)):
        if name in importlib.import_module(module).__all__:
            return f"from {module} import {name}"
    return None


def calling_frame() -> FrameType:
    """Return the frame in which the class statement stands whose `__init_subclass__` calls this."""
    return sys._getframe(2)  # noqa: SLF001  # the only way to see a class's surroundings; CPython 3.11–3.13 have it
