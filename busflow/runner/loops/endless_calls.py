"""EndlessCalls: finds a call in a worker thread that keeps virtual time still for too long, and names its line."""

from __future__ import annotations

import linecache
import os
import sys
import sysconfig
import threading
from collections.abc import Iterable, Iterator
from concurrent.futures import thread as pool
from contextvars import Context
from functools import partial
from pathlib import Path
from traceback import walk_stack
from types import FrameType
from typing import Any

import anyio

from busflow.clock import perf_counter
from busflow.runner.orphan_tasks import BUSFLOW, life_in
from busflow.text import printable
from busflow.validation.tracebacks import shown

_CHECK_S = 0.5
"""Real time between two checks of the threads, in seconds."""
_STDLIB, *_INSTALLED = (sysconfig.get_path(name) + os.sep for name in ("stdlib", "purelib", "platlib"))
_ANYIO = str(Path(anyio.__file__).parent) + os.sep


class EndlessCalls:
    """Measures how long the calls take that one loop has passed to worker threads."""

    def __init__(self, limit_s: float) -> None:
        """Set the limit of one call, in seconds of real time."""
        self.found: bool = False
        """True once a call has exceeded the limit: the loop then ends and waits for no thread."""
        self._limit_s = limit_s
        self._pause_s = min(_CHECK_S, limit_s / 2)
        self._checked_s = perf_counter()
        self._worked_s: dict[object, float] = {}
        """By call, for how long it was seen at work: one pause for each check after the first.

        A late check counts no more: what stops the whole process, such as Ctrl-Z or a suspended machine, is no call's.
        """

    def look(self, workers: Iterable[threading.Thread], *, pools: bool) -> str:
        """Return an error text if a call takes too long, else an empty text; calls in quick succession do nothing.

        Args:
            workers: The threads of anyio that work for the loop.
            pools: True if the loop waits for a call in a thread pool too; then all pools of the process are checked.
        """
        now_s = perf_counter()
        if now_s - self._checked_s < self._pause_s:
            return ""
        self._checked_s = now_s
        calls = dict(_calls({worker.ident for worker in workers}, pools=pools))
        self._worked_s = {call: self._worked_s.get(call, -self._pause_s) + self._pause_s for call in calls}
        for call, worked_s in self._worked_s.items():
            if worked_s >= self._limit_s:
                self.found = True
                self._worked_s = {}  # a frame keeps its variables alive
                return _description(calls[call], self._limit_s)
        return ""


def _calls(workers: set[int | None], *, pools: bool) -> Iterator[tuple[object, list[FrameType]]]:
    """Yield what is the same throughout each call in a worker thread, and its frames up to the worker's, from inside.

    A function that is no Python code has no frame: the worker's own is the only one.
    """
    for ident, innermost in sys._current_frames().items():  # noqa: SLF001  # documented in spite of its name
        frames = [frame for frame, _ in walk_stack(innermost)]
        for at, caller in enumerate(frames):
            file = caller.f_code.co_filename
            is_call = (file.startswith(_ANYIO) and ident in workers) or (pools and file == pool.__file__)
            if is_call and caller.f_code.co_name == "run":
                yield frames[at - 1] if at else _item(caller), frames[: at + 1]
                break


def _item(worker: FrameType) -> object:
    """Return the future of the call that a worker makes, of anyio or of a pool."""
    return worker.f_locals.get("future") or worker.f_locals.get("self")


def _function(worker: FrameType) -> str:
    """Return the name of the function that a worker calls."""
    names = worker.f_locals
    function: Any = names.get("func") or getattr(names.get("self"), "fn", None)
    while isinstance(function, partial):  # asyncio.to_thread passes one of a context's `run`
        function = function.args[0] if isinstance(getattr(function.func, "__self__", None), Context) else function.func
    module = getattr(function, "__module__", None)
    return f"{module}.{function.__qualname__}" if module and hasattr(function, "__qualname__") else repr(function)


def _description(frames: list[FrameType], limit_s: float) -> str:
    *frames, worker = frames
    own = [frame for frame in frames if not _is_library(frame.f_code.co_filename)]
    node = life_in(own)
    where = (
        _place((own or frames)[0]) if frames else f"{printable(_function(worker), limit=100)}, which is no Python code"
    )
    return (
        f"a thread{f' of {node.name}' if node else ''} has worked for {limit_s:g} s of real time, and virtual time "
        f"stands still for it: {where}; "
        "a driver that reads without end needs a fake in place of its device (docs/hardware.md, On virtual time), "
        "and a long computation @virtual_time(thread_s=…)"
    )


def _place(frame: FrameType) -> str:
    file, line = frame.f_code.co_filename, frame.f_lineno
    source = printable(linecache.getline(file, line).strip(), limit=100)
    return f"{printable(frame.f_code.co_qualname)} at {printable(shown(file))}:{line}: {source}"


def _is_library(file: str) -> bool:
    return file.startswith((_ANYIO, BUSFLOW)) or (file.startswith(_STDLIB) and not file.startswith(tuple(_INSTALLED)))
