"""Inbox: work from other threads for the event loop: messages to publish, and functions to call."""

from __future__ import annotations

import asyncio
from collections import Counter, deque
from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from threading import Lock
from typing import TypeVar

from busflow import timeouts
from busflow.bus.dispatcher import Dispatcher
from busflow.bus.statistics import InboxStatistics
from busflow.errors import NotRunning, WouldBlock

R = TypeVar("R")


INBOX_DROPPED, INBOX_REFUSED = "inbox_dropped", "inbox_refused"
"""Reasons of `Topic.losses` for messages that threads of this process published."""

INBOX_DEPTH = 4096
"""Messages from other threads that may wait for the loop."""


class Inbox:
    """A bounded, ordered, counted queue of messages from other threads; when full, it drops the oldest.

    The lock guards only the few instructions that decide which thread wakes the loop; no code waits while holding it.
    """

    __slots__ = ("_armed", "_closed", "_dispatcher", "_items", "_lock", "_loop", "dropped", "refused", "taken")

    def __init__(self, dispatcher: Dispatcher) -> None:
        self._dispatcher = dispatcher
        self._items: deque[tuple[Counter[str], Callable[[], None]]] = deque()
        self._lock = Lock()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._armed = False
        self._closed = False
        self.taken: int = 0
        self.dropped: int = 0
        self.refused: int = 0

    def open(self, loop: asyncio.AbstractEventLoop) -> None:
        """Start to deliver on this loop, beginning with the waiting messages."""
        with self._lock:
            self._loop, self._closed = loop, False
            self._armed = bool(self._items)
        if self._armed:
            loop.call_soon(self._drain)

    def close(self) -> None:
        """Stop delivering; waiting and later messages are dropped and counted."""
        with self._lock:
            self._loop, self._closed = None, True
            while self._items:
                self._drop(self._items.popleft()[0])

    def statistics(self) -> InboxStatistics:
        """Return the inbox's current counts, from any thread."""
        with self._lock:
            return InboxStatistics(self.taken, self.dropped, self.refused, waiting=len(self._items))

    def put(self, losses: Counter[str], publish: Callable[[], None]) -> None:
        """Enqueue one publish, from any thread, without waiting; `losses` are those of its topic."""
        with self._lock:
            if self._closed:
                self._drop(losses)
                return
            if len(self._items) >= INBOX_DEPTH:
                self._drop(self._items.popleft()[0])
            self._items.append((losses, publish))
            if self._armed or self._loop is None:
                return
            self._armed = True
            loop = self._loop
        with suppress(RuntimeError):  # the loop is closed: what waits is counted, or dropped by `close`
            loop.call_soon_threadsafe(self._drain)

    def call(self, function: Callable[[], R]) -> R:
        """Call a function on the loop, from another thread, and wait for its result or exception.

        Raises:
            NotRunning: there is no loop, or it did not call the function in time; it will not call it later.
        """
        future: Future[R] = Future()

        def answer() -> None:
            if future.set_running_or_notify_cancel():
                try:
                    future.set_result(function())
                except BaseException as error:  # noqa: BLE001  # raised in the calling thread
                    future.set_exception(error)

        with self._lock:
            loop = self._loop
        if loop is None:
            raise NotRunning("the graph's event loop is not running")
        try:
            loop.call_soon_threadsafe(answer)
        except RuntimeError:  # it is closed
            raise NotRunning("the graph's event loop has ended") from None
        try:
            return future.result(timeouts.current.thread_call)
        except TimeoutError:
            if not future.cancel():
                raise
            limit_s = timeouts.current.thread_call
            raise NotRunning(f"the graph's event loop did nothing else within {limit_s:g} s") from None

    def _drop(self, losses: Counter[str]) -> None:
        self.dropped += 1
        losses[INBOX_DROPPED] += 1

    def _drain(self) -> None:
        self._dispatcher.run_now(self._publish_waiting)

    def _publish_waiting(self) -> None:
        with self._lock:
            waiting = tuple(self._items)
            self._items.clear()
            self._armed = False
        done = 0
        try:
            for losses, publish in waiting:
                done += 1
                self.taken += 1
                try:
                    publish()
                except (WouldBlock, NotRunning):  # the thread no longer waits: only the count reports it
                    self.refused += 1
                    losses[INBOX_REFUSED] += 1
        finally:
            with self._lock:
                for losses, _ in waiting[done:]:
                    self._drop(losses)
