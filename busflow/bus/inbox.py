"""Inbox: what other threads hand to the event loop: messages to publish, and functions to call."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from threading import Lock
from typing import TypeVar

from busflow.bus.dispatcher import Dispatcher
from busflow.bus.statistics import InboxStatistics
from busflow.errors import NotRunning, WouldBlock

R = TypeVar("R")

CALL_TIMEOUT_S = 5.0
"""How long a thread waits for the loop to do what it asks, in wall time."""

INBOX_DEPTH = 4096
"""Messages from other threads that may wait for the loop."""


class Inbox:
    """What other threads hand to the loop: in order, bounded, counted; a full inbox loses its oldest.

    The lock only guards the few instructions that decide who wakes the loop; nothing waits while holding it.
    """

    __slots__ = ("_armed", "_closed", "_dispatcher", "_items", "_lock", "_loop", "dropped", "refused", "taken")

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher
        self._items: deque[Callable[[], None]] = deque()
        self._lock = Lock()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._armed = False
        self._closed = False
        self.taken = 0
        self.dropped = 0
        self.refused = 0

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Deliver on this loop, first of all what came before."""
        with self._lock:
            self._loop, self._closed = loop, False
            self._armed = bool(self._items)
        if self._armed:
            loop.call_soon(self._drain)

    def close(self) -> None:
        """Deliver no more; what waits, or comes later, is lost and counted."""
        with self._lock:
            self._loop, self._closed = None, True
            self.dropped += len(self._items)
            self._items.clear()

    def statistics(self) -> InboxStatistics:
        """What the inbox has counted, as it stands now; from any thread."""
        with self._lock:
            return InboxStatistics(self.taken, self.dropped, self.refused, waiting=len(self._items))

    def put(self, publish: Callable[[], None]) -> None:
        """Hand over one publish, from any thread, without waiting."""
        with self._lock:
            if self._closed:
                self.dropped += 1
                return
            if len(self._items) >= INBOX_DEPTH:
                self._items.popleft()
                self.dropped += 1
            self._items.append(publish)
            if self._armed or self._loop is None:
                return
            self._armed = True
            loop = self._loop
        loop.call_soon_threadsafe(self._drain)

    def call(self, function: Callable[[], R]) -> R:
        """Call a function on the loop, from another thread, and wait for what it returns or raises.

        Raises:
            NotRunning: there is no loop, or it does not come round to it in time; then it is not called later either.
        """
        future: Future[R] = Future()

        def answer() -> None:
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(function())
                except BaseException as error:  # noqa: BLE001  # it is raised where it was called
                    future.set_exception(error)

        with self._lock:
            loop = self._loop
        if loop is None:
            raise NotRunning("the graph's event loop is not running")
        loop.call_soon_threadsafe(answer)
        try:
            return future.result(CALL_TIMEOUT_S)
        except TimeoutError:
            if not future.cancel():
                raise
            raise NotRunning(f"the graph's event loop did nothing else within {CALL_TIMEOUT_S:g} s") from None

    def _drain(self) -> None:
        self._dispatcher.run_now(self._publish_waiting)

    def _publish_waiting(self) -> None:
        with self._lock:
            waiting = tuple(self._items)
            self._items.clear()
            self._armed = False
        done = 0
        try:
            for publish in waiting:
                done += 1
                self.taken += 1
                try:
                    publish()
                except (WouldBlock, NotRunning):  # the thread has long gone on: the count is how it is told
                    self.refused += 1
        finally:
            self.dropped += len(waiting) - done
