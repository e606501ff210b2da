"""Stuck handlers: names one that does not come back while virtual time stands still for it, and ends it in a test.

On virtual time nothing else would: no timeout passes. A thread looks at the loop in real time. It is none of
`threading`, since virtual time waits for those. The warning goes to standard error, where pytest and `busflow test`
show it at once: a line in the log would make a slow run another one than a fast one.
"""

from __future__ import annotations

import _thread
import asyncio
import ctypes
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from busflow import timeouts
from busflow.errors import Deadlock
from busflow.runner import standard_error
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.watchdog import owners, stack_of
from busflow.text import printable

_LOOK_S = 0.5
_DEBUGGERS = {"bdb.py", "pydevd.py"}
"""Files that run while a line of a debugged program waits, also in editors."""


@contextmanager
def stuck_handlers_named() -> Generator[None]:
    """Watch the running loop while the block lasts, if it is one on virtual time."""
    loop, ended = asyncio.get_running_loop(), threading.Event()
    if isinstance(loop, VirtualLoop):
        _thread.start_new_thread(_watch, (loop, threading.get_ident(), ended))
    try:
        yield
    finally:
        ended.set()


def _watch(loop: VirtualLoop, thread: int, ended: threading.Event) -> None:
    warn_s = timeouts.current.stuck_warning
    look_s = min(_LOOK_S, loop.thread_s / 4)
    # Each look counts for the time until the next one, however late it is: what stops the whole process, such as Ctrl-Z
    # or a suspended machine, is no handler's time.
    seen, stuck_s, warned = loop.moment, 0.0, False
    while not ended.wait(look_s):
        stuck_s += look_s
        if loop.moment != seen:
            seen, stuck_s, warned = loop.moment, 0.0, False
            continue
        frame = sys._current_frames().get(thread)  # noqa: SLF001  # there is no other way to see it
        owner = next(owners(frame), None)
        if owner is None or _is_debugged(frame):  # it waits for others, or for a person
            stuck_s = 0.0
            continue
        if loop.ends_handlers and stuck_s >= loop.thread_s:
            error = ctypes.py_object(_error(owner[1], loop.thread_s))
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), error)
            stuck_s = 0.0
        elif stuck_s >= warn_s and not warned:
            warned = True
            node, handler = map(printable, owner)
            text = f"has not come back for {warn_s:g} s of real time, and virtual time stands still for it"
            standard_error.write(f"{node}: {handler} {text}; it is in {stack_of(frame)}")


def _is_debugged(frame: FrameType | None) -> bool:
    """Return whether a debugger has stopped the code."""
    while frame is not None:
        if Path(frame.f_code.co_filename).name in _DEBUGGERS:
            return True
        frame = frame.f_back
    return False


def _error(handler: str, limit_s: float) -> type[Deadlock]:
    """Return the class of the error: Python raises one of it in the other thread, without arguments."""

    class Stuck(Deadlock):
        def __init__(self) -> None:
            super().__init__(
                f"{handler} has not come back for {limit_s:g} s of real time, and virtual time stands still for it; "
                "a long computation gets more with @virtual_time(thread_s=…)"
            )

    Stuck.__name__ = Stuck.__qualname__ = Deadlock.__name__
    return Stuck
