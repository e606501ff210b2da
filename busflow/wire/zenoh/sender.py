"""Sender: a thread for function calls that may wait for the link, so that the event loop never waits for it.

Zenoh accepts a message of some hundred bytes within a microsecond, however slow its readers are. It copies a large
message and cuts it into pieces. The first piece for which a stalled reader has no room waits up to 300 ms, and every
message that is put into the same priority queue of Zenoh waits with it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from busflow import timeouts

LARGE = 48 * 1024
"""Payloads of this size and more leave through the sender, in bytes; Zenoh itself cuts payloads beyond 64 KiB.
On a line they lie in shared memory, or travel in parts of this size.
"""
DEPTH = 1024
"""Limit of the waiting calls; the oldest is dropped for a new one."""
MOST_BYTES = 64 * 1024 * 1024
"""The same limit in bytes; a larger payload waits alone."""
LARGEST = 256 * 1024 * 1024
"""Limit of one payload in bytes. Zenoh takes so long to cut a larger one that the link counts as dead."""


class SenderThread:
    """Runs functions one after another in a thread of its own, started on first use."""

    def __init__(self, name: str, *, on_error: Callable[[Exception], None]) -> None:
        """Create a sender; `on_error` is called in its thread with each unexpected error."""
        self.name = name
        self.dropped: int = 0
        self.largest: int = 0
        """Size of the largest payload that was handed to it, in bytes."""
        self._on_error = on_error
        self._work: deque[tuple[int, Callable[[], None]]] = deque()
        self._bytes = 0
        self._lock = threading.RLock()
        self._arrived = threading.Condition(self._lock)
        self._finished = threading.Condition(self._lock)
        self._closed = False
        self._working = False
        self._thread: threading.Thread | None = None

    @property
    def is_idle(self) -> bool:
        """True if all functions that were queued have returned."""
        with self._lock:
            return not self._work and not self._working

    def hand(self, work: Callable[[], None], size: int = 0) -> None:
        """Queue a function; if the queue is full, the oldest is dropped and counted."""
        with self._arrived:
            if self._closed:
                self.dropped += 1
                return
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name=self.name, daemon=True)
                self._thread.start()
            while self._work and (len(self._work) >= DEPTH or self._bytes + size > MOST_BYTES):
                self._drop_oldest()
            self._work.append((size, work))
            self._bytes += size
            self.largest = max(self.largest, size)
            self._arrived.notify()

    def finish(self, patience_s: float) -> None:
        """Wait until all functions that were queued have returned, no longer than this."""
        with self._finished:
            self._finished.wait_for(lambda: self.is_idle, patience_s)

    def close(self) -> None:
        """Drop the queued functions, and accept no more. Close the session before: that wakes a waiting put."""
        with self._arrived:
            self._closed = True
            while self._work:
                self._drop_oldest()
            self._arrived.notify()
        if self._thread is not None:
            self._thread.join(timeouts.current.sender_end)

    def _drop_oldest(self) -> None:
        size, _ = self._work.popleft()
        self._bytes -= size
        self.dropped += 1

    def _run(self) -> None:
        while True:
            with self._arrived:
                self._working = False
                if not self._work:
                    self._finished.notify_all()
                while not self._work:
                    if self._closed:
                        return
                    self._arrived.wait()
                size, work = self._work.popleft()
                self._bytes -= size
                self._working = True
            try:
                work()
            except Exception as error:  # noqa: BLE001  # the owner gets the error, and the thread goes on
                self._on_error(error)
            del work  # else its objects would stay alive until the next function
