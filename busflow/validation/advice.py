"""Advice: what to write in place of code that Python has refused."""

from __future__ import annotations

import builtins
import pkgutil
import re
import sys
from collections.abc import Collection
from inspect import CORO_CREATED, getcoroutinestate, iscoroutine
from traceback import walk_tb
from types import TracebackType

from busflow.text import nearest, printable

_IMPORTED = re.compile(r"cannot import name '(\w+)'")
"""The only place in which Python 3.11 has the name that a module lacks."""
_SECOND_LOOP = re.compile(r"a running event loop|loop is (already )?running|Already running asyncio")
"""What asyncio and anyio say of a loop that is to run in another."""


_RCLPY = {"call_async": "await client.call(request)", "wait_for_service": "await client.ready(timeout=5)"}
"""Names of a client in rclpy, and what to write instead."""


def advice(error: BaseException) -> str | None:
    """Return what to do about an exception: the nearest name to a misspelt one, or a forgotten await."""
    if isinstance(error, AttributeError) and iscoroutine(error.obj):
        return f"write await before the call of {error.obj.__qualname__}"
    if isinstance(error, RuntimeError) and _SECOND_LOOP.search(str(error)):
        return "await what is to run, in an async def"
    if isinstance(error, AttributeError) and (instead := _RCLPY.get(str(error.name))):
        return f"write {instead}"
    try:
        word, known = _missing(error)
    except Exception:  # noqa: BLE001  # the user's __dir__ may raise anything
        return None
    meant = nearest(word, [each for each in known if word.startswith("_") or not each.startswith("_")])
    return None if meant is None else f"did you mean {printable(meant)!r}?"


def close_unawaited(error: BaseException) -> None:
    """Close the coroutines that an exception shows to lack an await, so that Python does not warn of it as well."""
    held: list[object] = [getattr(error, "obj", None)]
    if isinstance(error, RuntimeError) and _SECOND_LOOP.search(str(error)):
        # The frames of asyncio hold what it was to run.
        held += [each for frame, _ in walk_tb(error.__traceback__) for each in frame.f_locals.values()]
    for each in held:
        if iscoroutine(each) and getcoroutinestate(each) == CORO_CREATED:
            each.close()


def _missing(error: BaseException) -> tuple[str, Collection[str]]:
    """Return the name that Python has not found, and those that are there; none for another error."""
    match error:
        case AttributeError(name=str(word), obj=owner) if f"no attribute {word!r}" in str(error):
            return word, dir(owner)
        case ModuleNotFoundError(name=str(module)):
            parent, _, word = module.rpartition(".")
            return word, [each.name for each in pkgutil.iter_modules(getattr(sys.modules.get(parent), "__path__", []))]
        case ImportError(name=str(module)) if found := _IMPORTED.match(str(error)):
            return found[1], {*dir(sys.modules[module]), *getattr(sys.modules[module], "__all__", ())}
        case NameError(name=str(word), __traceback__=TracebackType() as way):
            while way.tb_next:
                way = way.tb_next
            return word, {*way.tb_frame.f_locals, *way.tb_frame.f_globals, *dir(builtins)}
        case _:
            return "", ()
