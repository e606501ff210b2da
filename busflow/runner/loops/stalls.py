"""Finds the line of code in which each unfinished task of a loop waits."""

from __future__ import annotations

import asyncio
import linecache
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import anyio

from busflow.node import node
from busflow.text import printable

_LIBRARIES = (*(str(Path(str(module.__file__)).parent) for module in (asyncio, anyio)), str(node.__file__))


def waiting(loop: asyncio.AbstractEventLoop) -> list[str]:
    """Return a line for each unfinished task but the one that runs, in the order of their names."""
    running = asyncio.current_task(loop)
    return sorted(describe(task) for task in asyncio.all_tasks(loop) if not task.done() and task is not running)


def describe(task: asyncio.Task[Any]) -> str:
    """Describe a task: its name, what it waits for, and the line of its code where it waits."""
    steps = list(_steps(task.get_coro()))
    what = _awaited_tasks(task) or (printable(steps[-1][0]) if steps else "its first step")
    line = f"{_named(task)} waits for {what}"
    for name, frame in reversed(steps):
        file, number = frame.f_code.co_filename, frame.f_lineno
        if not file.startswith(_LIBRARIES):
            source = printable(linecache.getline(file, number).strip(), limit=100)
            return f"{line} in {printable(name)} at {printable(file)}:{number}: {source}"
    return line


def _steps(awaited: Any) -> Iterator[tuple[str, FrameType]]:
    """Yield each coroutine or generator from the task's own to the innermost, as far as Python shows them."""
    while awaited is not None:
        for kind, inner in (("cr", "cr_await"), ("gi", "gi_yieldfrom"), ("ag", "ag_await")):
            frame: FrameType | None = getattr(awaited, f"{kind}_frame", None)
            if frame is not None:
                yield awaited.__qualname__, frame
                awaited = getattr(awaited, inner)
                break
        else:
            return


def _awaited_tasks(task: asyncio.Task[Any]) -> str:
    """Return the names of the tasks that this one awaits, itself or through `gather`."""
    future: Any = getattr(task, "_fut_waiter", None)
    awaited: list[Any] = getattr(future, "_children", [future])
    return " and ".join(sorted(_named(each) for each in awaited if isinstance(each, asyncio.Task)))


def _named(task: Any) -> str:
    return f"task '{printable(task.get_name())}'"
