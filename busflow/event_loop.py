"""The event loop that `busflow run` uses: asyncio's own, waiting to the microsecond instead of to the millisecond."""

from __future__ import annotations

import asyncio
import select
import selectors
import socket
import sys
from collections.abc import Callable
from typing import TypeAlias, cast

LoopFactory: TypeAlias = Callable[[], asyncio.AbstractEventLoop]

_SELECT_LIMIT = 1024
"""The highest file descriptor that `select()` takes on Linux is one less."""


def new_event_loop() -> asyncio.AbstractEventLoop:
    """An asyncio loop; where it waits with epoll, its timers are not rounded up to whole milliseconds.

    CPython's epoll selector rounds every timeout up to a millisecond, which makes each tick of a timer that late. The
    epoll object is itself a file that `select()` can wait for, to the microsecond.
    """
    return _Loop(PreciseSelector() if sys.platform == "linux" else selectors.DefaultSelector())


class _Loop(asyncio.SelectorEventLoop):
    """Is woken by other threads cheaply, and ends without waiting for calls that a node left in `asyncio.to_thread`."""

    def _read_from_self(self) -> None:
        """Take out what other threads and signals have woken the loop with.

        asyncio looks once more, finds nothing, and catches the error: a fifth of what it costs to be woken (58 µs of
        CPU time, 45 so). Should there be more than this takes, the loop wakes again.
        """
        waker = cast("socket.socket", self._ssock)  # type: ignore[attr-defined]  # asyncio's own
        try:
            woken_by = waker.recv(4096)
        except (BlockingIOError, InterruptedError):
            return
        self._process_self_data(woken_by)  # type: ignore[attr-defined]  # zeros, and the numbers of signals

    async def shutdown_default_executor(self, *_args: float | None) -> None:
        executor = getattr(self, "_default_executor", None)
        if executor is not None:
            executor.shutdown(wait=False, cancel_futures=True)


if sys.platform == "linux":  # no other system has epoll, and the selectors of others are precise enough

    class PreciseSelector(selectors.EpollSelector):
        """Waits with `select()` on the epoll object, then asks epoll what there is."""

        def select(self, timeout: float | None = None) -> list[tuple[selectors.SelectorKey, int]]:
            """What is ready by then."""
            if timeout is not None and timeout <= 0:  # a busy loop asks so each turn, of which this saves a sixth
                waits: list[tuple[int, int]] = self._selector.poll(0, 1)  # type: ignore[attr-defined]  # its epoll object
                return super().select(0) if waits else []
            if timeout is None or self.fileno() >= _SELECT_LIMIT:
                return super().select(timeout)
            ready, _, _ = select.select([self.fileno()], [], [], timeout)
            return super().select(0) if ready else []
