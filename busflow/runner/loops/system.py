"""The event loop that `busflow run` uses: asyncio's own, which waits to the microsecond and is woken cheaply.

Other threads wake it for every message that comes from another process. asyncio's way to do so takes four system calls
and a callback: two so, and none where the loop is about to wake anyhow.
"""

from __future__ import annotations

import asyncio
import io
import os
import select
import selectors
import sys
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TypeAlias

from busflow import timeouts

LoopFactory: TypeAlias = Callable[[], asyncio.AbstractEventLoop]

_SELECT_LIMIT = 1024
"""The highest file descriptor that `select()` takes on Linux is one less."""
_ONE = (1).to_bytes(8, sys.byteorder)
SELECTORS: list[type[selectors.BaseSelector]] = [selectors.DefaultSelector, selectors.SelectSelector]
"""Selectors in which an event loop waits on this platform."""


def new_event_loop() -> asyncio.AbstractEventLoop:
    """Return an asyncio loop; where it waits with epoll, its timers are not rounded up to whole milliseconds."""
    if sys.platform == "linux":
        selector = PreciseSelector()
        if max(selector.watched) < _SELECT_LIMIT:
            return _WokenLoop(selector)
        selector.close()
    return _Loop(selectors.DefaultSelector())


def answers(loop: asyncio.AbstractEventLoop) -> bool:
    """Return whether an event loop soon calls what another thread gives it."""
    answered = threading.Event()
    with suppress(RuntimeError):  # it is closed
        loop.call_soon_threadsafe(answered.set)
    return answered.wait(timeouts.current.loop_answer)


class _Loop(asyncio.SelectorEventLoop):
    """Ends without waiting for calls that a node left in `asyncio.to_thread`."""

    def __del__(self) -> None:
        if hasattr(self, "_ssock"):  # else no more files may be open, and asyncio's own way ends in a traceback
            super().__del__()

    async def shutdown_default_executor(self, *_args: float | None) -> None:
        executor = getattr(self, "_default_executor", None)
        if executor is not None:
            executor.shutdown(wait=False, cancel_futures=True)


if sys.platform == "linux":  # no other system has epoll, and the selectors of others are precise enough

    class PreciseSelector(selectors.EpollSelector):
        """Waits with `select()`, to the microsecond, on the epoll object, which is a file itself, and on a bell.

        CPython's epoll selector rounds every timeout up to a millisecond, which makes each tick of a timer that late.
        """

        def __init__(self) -> None:
            super().__init__()
            self._eventfd = io.FileIO(os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK), "r+")
            # Another thread may write while this one closes, and by then the number may be another file's. A signal's
            # handler may wake the thread that is just waking: hence reentrant.
            self._ringing = threading.RLock()
            self._woken = False
            self.watched: tuple[int, int] = self.fileno(), self._eventfd.fileno()
            """File descriptors that are waited for: that of epoll, and the bell."""

        def wake(self) -> None:
            """End a wait, or keep the next one from beginning; from any thread."""
            if not self._woken:
                self._woken = True
                with self._ringing, suppress(ValueError):  # it was closed meanwhile: nothing waits
                    self._eventfd.write(_ONE)

        def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
            """Return what is ready by then."""
            if timeout is not None and timeout <= 0:  # a busy loop asks so each turn, of which this saves a sixth
                waits: list[tuple[int, int]] = self._selector.poll(0, 1)  # type: ignore[attr-defined]  # its epoll object
                return super().select(0) if waits else []
            ready, _, _ = select.select(self.watched, (), (), timeout)
            epoll, eventfd = self.watched
            if eventfd in ready:
                try:
                    self._eventfd.read(8)
                finally:  # not before, or a `wake` in between would find the flag set and the descriptor empty
                    self._woken = False
            return super().select(0) if epoll in ready else []

        def close(self) -> None:
            """Close the selector."""
            with self._ringing:
                self._eventfd.close()
            super().close()

    SELECTORS.append(PreciseSelector)

    class _WokenLoop(_Loop):
        """Is woken by its selector's bell; signals alone come through asyncio's pair of sockets."""

        def __init__(self, selector: PreciseSelector) -> None:
            super().__init__(selector)
            self._wake = selector.wake

        def _write_to_self(self) -> None:
            """Wake the loop from another thread; asyncio calls it once the callback is in the loop's line."""
            self._wake()
