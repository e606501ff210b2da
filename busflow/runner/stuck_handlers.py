"""Stuck handlers: names one that does not come back while virtual time stands still for it, and ends it in a test.

On virtual time nothing else would: no timeout passes, and Ctrl-C waits for the next turn of the loop. A thread looks at
the loop in real time. It is none of `threading`, since virtual time waits for those.
"""

from __future__ import annotations

import _thread
import asyncio
import ctypes
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from busflow.clock import perf_counter
from busflow.errors import Deadlock
from busflow.runner.loops.virtual import VirtualLoop
from busflow.runner.watchdog import owners, stack_of

if TYPE_CHECKING:
    from busflow.log import Log

_LOOK_S = 0.5
_WARN_S = 5.0


@contextmanager
def stuck_handlers_named(log: Log) -> Generator[None]:
    """Watch the running loop while the block lasts, if it is one on virtual time."""
    loop, ended = asyncio.get_running_loop(), threading.Event()
    if isinstance(loop, VirtualLoop):
        _thread.start_new_thread(_watch, (loop, threading.get_ident(), log, ended))
    try:
        yield
    finally:
        ended.set()


def _watch(loop: VirtualLoop, thread: int, log: Log, ended: threading.Event) -> None:
    look_s = min(_LOOK_S, loop.thread_s / 4)
    seen, since_s, warned = loop.moment, perf_counter(), False
    while not ended.wait(look_s):
        if loop.moment != seen:
            seen, since_s, warned = loop.moment, perf_counter(), False
            continue
        frame = sys._current_frames().get(thread)  # noqa: SLF001  # there is no other way to see it
        owner = next(owners(frame), None)
        if owner is None:  # it waits for others
            since_s = perf_counter()
            continue
        stuck_s = perf_counter() - since_s
        if loop.ends_handlers and stuck_s >= loop.thread_s:
            error = ctypes.py_object(_error(owner[1], loop.thread_s))
            ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(thread), error)
            since_s = perf_counter()
        elif stuck_s >= _WARN_S and not warned:
            warned = True
            text = f"has not come back for {_WARN_S:g} s of real time, and virtual time stands still for it"
            log.bind(owner[0]).warning(text, handler=owner[1], stack=stack_of(frame))


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
