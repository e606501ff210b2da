"""Sender: a thread that does what may wait for the link, so that the loop never does.

A message of some hundred bytes is handed to Zenoh in a microsecond, whoever reads it and however slowly. A large one is
copied and cut into pieces, and the first one that a stalled reader has no room for waits up to 300 ms; whoever puts
something into the same line of Zenoh's meanwhile waits with it.
"""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

LARGE = 48 * 1024
"""Payloads from this size on leave through the sender, bytes; Zenoh cuts what is beyond 64 KiB with its own words."""
DEPTH = 1024
"""How much may wait to be done; the oldest gives way."""
MOST_BYTES = 64 * 1024 * 1024
"""The same in bytes; what is larger than all of it goes alone."""
_PATIENCE_S = 5.0


class SenderThread:
    """Runs what it is handed, one after the other, in a thread of its own, which is started when first needed."""

    def __init__(self, name: str, *, on_error: Callable[[Exception], None]) -> None:
        """A sender; `on_error` hears, in its thread, of what fails in a way that nobody foresaw."""
        self.name = name
        self.dropped = 0
        self._on_error = on_error
        self._work: deque[tuple[int, Callable[[], None]]] = deque()
        self._bytes = 0
        self._arrived = threading.Condition()
        self._closed = False
        self._thread: threading.Thread | None = None

    def hand(self, work: Callable[[], None], size: int = 0) -> None:
        """Do this soon; where too much waits already, the oldest is not done and counted as dropped."""
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
            self._arrived.notify()

    def close(self) -> None:
        """Take no more; what waits is dropped. The session has to be closed before, which wakes a waiting put."""
        with self._arrived:
            self._closed = True
            while self._work:
                self._drop_oldest()
            self._arrived.notify()
        if self._thread is not None:
            self._thread.join(_PATIENCE_S)

    def _drop_oldest(self) -> None:
        size, _ = self._work.popleft()
        self._bytes -= size
        self.dropped += 1

    def _run(self) -> None:
        while True:
            with self._arrived:
                while not self._work:
                    if self._closed:
                        return
                    self._arrived.wait()
                size, work = self._work.popleft()
                self._bytes -= size
            try:
                work()
            except Exception as error:  # noqa: BLE001  # the thread has more to do, and whoever owns it is told
                self._on_error(error)
            del work  # what it holds is not to wait here for the next
